// Reads a bag as Foxglove and Lichtblick do and prints every message as a line of JSON: [topic, log time, message].
// Numbers that JSON lacks and integers of 64 bits become text; a time becomes its nanoseconds.
import { open } from "node:fs/promises";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import { McapIndexedReader } from "@mcap/core";
import { decompress } from "fzstd";

const file = await open(process.argv[2]);
const readable = {
  size: async () => BigInt((await file.stat()).size),
  read: async (offset, size) => {
    const buffer = new Uint8Array(Number(size));
    await file.read(buffer, 0, Number(size), Number(offset));
    return buffer;
  },
};

function plain(value) {
  if (typeof value === "bigint") return value.toString();
  if (typeof value === "number") return Number.isFinite(value) ? value : String(value);
  if (ArrayBuffer.isView(value) || Array.isArray(value)) return Array.from(value, plain);
  if (typeof value !== "object") return value;
  const nanoseconds = value.nsec ?? value.nanosec;
  if (nanoseconds !== undefined) return (BigInt(value.sec) * 1000000000n + BigInt(nanoseconds)).toString();
  return Object.fromEntries(Object.entries(value).map(([name, entry]) => [name, plain(entry)]));
}

const reader = await McapIndexedReader.Initialize({
  readable,
  decompressHandlers: { zstd: (buffer, size) => decompress(buffer, new Uint8Array(Number(size))) },
});
const decoders = new Map();
for (const [id, channel] of reader.channelsById) {
  const schema = reader.schemasById.get(channel.schemaId);
  decoders.set(id, new MessageReader(parse(new TextDecoder().decode(schema.data), { ros2: true })));
}
for await (const message of reader.readMessages()) {
  const { topic } = reader.channelsById.get(message.channelId);
  const decoded = decoders.get(message.channelId).readMessage(message.data);
  process.stdout.write(`${JSON.stringify([topic, message.logTime.toString(), plain(decoded)])}\n`);
}
