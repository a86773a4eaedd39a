// Reads a bag as Foxglove and Lichtblick do and prints every message as a line of JSON: [topic, log time, message].
// Numbers that JSON lacks and integers of 64 bits become text; a time becomes its nanoseconds.
import { open } from "node:fs/promises";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import { McapIndexedReader } from "@mcap/core";
import { decompress } from "fzstd";
import protobuf from "protobufjs";
import "protobufjs/ext/descriptor/index.js";

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
  if (typeof value !== "object" || value === null) return value;
  const nanoseconds = value.nsec ?? value.nanosec ?? value.nanos;
  if (nanoseconds !== undefined) return (BigInt(value.sec ?? value.seconds) * 1000000000n + BigInt(nanoseconds)).toString();
  return Object.fromEntries(Object.entries(value).map(([name, entry]) => [name, plain(entry)]));
}

const reader = await McapIndexedReader.Initialize({
  readable,
  decompressHandlers: { zstd: (buffer, size) => decompress(buffer, new Uint8Array(Number(size))) },
});

/* What decodes the messages of a channel. */
function decoder(channel, schema) {
  const text = () => new TextDecoder().decode(schema.data);
  switch (schema.encoding) {
    case "ros2msg": {
      const messages = new MessageReader(parse(text(), { ros2: true }));
      return (data) => messages.readMessage(data);
    }
    case "protobuf": {
      const set = protobuf.Root.fromDescriptor(schema.data);
      const type = set.lookupType(schema.name);
      return (data) => type.toObject(type.decode(data), { longs: Number, defaults: true });
    }
  }
  throw new Error(`${channel.topic}: schema encoding ${schema.encoding}`);
}

const decoders = new Map();
for (const [id, channel] of reader.channelsById) {
  decoders.set(id, decoder(channel, reader.schemasById.get(channel.schemaId)));
}
for await (const message of reader.readMessages()) {
  const { topic } = reader.channelsById.get(message.channelId);
  const decoded = decoders.get(message.channelId)(message.data);
  process.stdout.write(`${JSON.stringify([topic, message.logTime.toString(), plain(decoded)])}\n`);
}
