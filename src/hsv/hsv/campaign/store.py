"""Where results are kept: finished batches beside the result file while flying, one Parquet file in the end."""

from __future__ import annotations

import fcntl
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pyarrow.parquet as pq

from hsv.campaign.campaign import Campaign
from hsv.campaign.envelope import Envelope
from hsv.campaign.table import CAMPAIGN, COMPRESSION, ENVELOPE, schema
from hsv.errors import CampaignError

_CAMPAIGN_FILE = "campaign.json"


class Store:
    """Keeps the batches of one campaign; whatever happens to this process, what it has kept stays whole."""

    def __init__(self, out: Path, campaign: Campaign) -> None:
        self.out = out
        self.folder = out.with_name(out.name + ".parts")
        self._campaign = campaign

    @contextmanager
    def opened(self, restart: bool = False) -> Iterator[set[int]]:
        """Yield the numbers of the batches that are there; only one process at a time may hold a campaign.

        Args:
            restart: Throw away what is there.

        Raises:
            CampaignError: The file or folder belongs to another campaign, cannot be made, or is in use.
        """
        if restart:
            shutil.rmtree(self.folder, ignore_errors=True)
            self.out.unlink(missing_ok=True)
        if self.out.exists():
            self._check(read_campaign(self.out), self.out)
            shutil.rmtree(self.folder, ignore_errors=True)
            yield set(range(self._campaign.batches))
            return
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise CampaignError(f"out = {str(self.out)!r}: cannot be written ({error.strerror})") from error
        with (self.folder / "lock").open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise CampaignError(f"{self.folder}: in use, another process is flying this campaign") from None
            described = self.folder / _CAMPAIGN_FILE
            if described.exists():
                self._check(Campaign.from_text(described.read_text(encoding="utf-8")), self.folder)
            else:
                _write(described, self._campaign.text.encode())
            yield {int(path.stem) for path in self.folder.glob("*.parquet")}

    def keep(self, batch: int, content: bytes) -> None:
        """Keep a finished batch: it is there whole, or not at all."""
        _write(self._part(batch), content)

    def finish(self) -> None:
        """Make the result file of all batches, and remove them."""
        temporary = self.out.with_name(self.out.name + ".unfinished")
        envelope = Envelope.empty()
        columns = schema(self._campaign)
        with pq.ParquetWriter(temporary, columns, compression=COMPRESSION) as writer:
            for batch in range(self._campaign.batches):
                part = pq.read_table(self._part(batch))
                envelope.merge(Envelope.decode(part.schema.metadata[ENVELOPE].decode()))
                writer.write_table(part.cast(columns))
            writer.add_key_value_metadata({CAMPAIGN: self._campaign.text, ENVELOPE: envelope.encode()})
        _replace(temporary, self.out)
        shutil.rmtree(self.folder)

    def _part(self, batch: int) -> Path:
        return self.folder / f"{batch:08}.parquet"

    def _check(self, found: Campaign, where: Path) -> None:
        difference = found.difference(self._campaign)
        if difference:
            raise CampaignError(
                f"{where}: holds another campaign ({difference}), expected the same one, another --out, or --restart"
            )


def read_campaign(path: Path) -> Campaign:
    """Return the campaign whose results are in a Parquet file.

    Raises:
        CampaignError: The file is missing or not the result of a campaign.
    """
    try:
        metadata = pq.read_metadata(path).metadata or {}
    except (OSError, ValueError) as error:
        raise CampaignError(f"{path}: cannot be read, expected the Parquet file of a campaign") from error
    if CAMPAIGN not in metadata:
        raise CampaignError(f"{path}: not the result of a campaign, expected a file of hsv montecarlo")
    return Campaign.from_text(metadata[CAMPAIGN].decode())


def _write(path: Path, content: bytes) -> None:
    temporary = path.with_name(path.name + ".unfinished")
    temporary.write_bytes(content)
    _replace(temporary, path)


def _replace(temporary: Path, path: Path) -> None:
    """Move a finished file into place, on the disk before it has its name."""
    with temporary.open("rb") as stream:
        os.fsync(stream.fileno())
    temporary.replace(path)
