"""Storage of results: one file per batch while the campaign flies, then a single Parquet file, the result file."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Mapping
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from hsv.base.errors import CampaignError, DocumentError
from hsv.base.files import open_regular, read_text
from hsv.flight.campaign.campaign import Campaign
from hsv.flight.campaign.envelope import Envelope
from hsv.flight.campaign.run import Store, replace_file, write_whole, writing
from hsv.flight.campaign.sample_runner import CAMPAIGN, DIGEST, ENVELOPE, FORMAT, LATEST, WRITTEN, fly_batch, schema

_CAMPAIGN_FILE = "campaign.json"


class ResultStore(Store):
    """Stores the batches of one campaign, then its result file; a stored batch is complete even after a crash."""

    def __init__(self, out: Path, campaign: Campaign) -> None:
        super().__init__(out, out.with_name(out.name + ".lock"), fly_batch)
        self.out = out
        self.folder = out.with_name(out.name + ".parts")
        self._campaign = campaign

    def finished(self, restart: bool) -> set[int]:
        """Return the numbers of the finished batches, none with ``restart``, which deletes existing results."""
        if restart:
            shutil.rmtree(self.folder, ignore_errors=True)
            self.out.unlink(missing_ok=True)
        batches = self.numbers()
        if self.out.exists():
            self._check(read_result(self.out)[0], self.out)
            shutil.rmtree(self.folder, ignore_errors=True)
            return set(batches)
        described = self.folder / _CAMPAIGN_FILE
        if described.exists():
            try:
                found = Campaign.from_text(read_text(described))
            except (CampaignError, DocumentError) as error:
                raise CampaignError(f"{described}: {error}; --restart begins anew") from error
            self._check(found, self.folder)
        else:
            with writing(self.folder):
                self.folder.mkdir(exist_ok=True)
            write_whole(described, self._campaign.text.encode())
        return {batch for batch in batches if self._is_whole(batch)}

    def finish(self) -> None:
        """Unless the result file exists, join the files of all batches into it, and then delete these files."""
        if self.out.exists():
            return
        temporary = self.out.with_name(self.out.name + ".unfinished")
        envelope = Envelope.empty()
        columns = schema(self._campaign)
        with writing(self.out, temporary):
            with pq.ParquetWriter(temporary, columns, **WRITTEN) as writer:
                for batch in self.numbers():
                    part, its_envelope = self._read(batch)
                    envelope.merge(its_envelope)
                    writer.write_table(part.cast(columns))
                kept = {CAMPAIGN: self._campaign.text.encode(), ENVELOPE: envelope.encode().encode()}
                writer.add_key_value_metadata(kept | {DIGEST: result_digest(kept), FORMAT: LATEST})
            replace_file(temporary, self.out)
        shutil.rmtree(self.folder)

    def numbers(self) -> range:
        """Return the numbers of the batches."""
        return range(len(self._campaign.batches))

    def _is_whole(self, batch: int) -> bool:
        try:
            with pq.ParquetFile(self.path(batch)) as file:
                found, rows = file.schema_arrow, file.metadata.num_rows
        except (OSError, ValueError):
            return False
        complete = rows == self._campaign.batches[batch].flights and ENVELOPE in (found.metadata or {})
        return complete and bool(found.equals(schema(self._campaign)))

    def _read(self, batch: int) -> tuple[pa.Table, Envelope]:
        path = self.path(batch)
        try:
            with pq.ParquetFile(path, page_checksum_verification=True) as file:
                part = file.read(use_threads=False)
            return part, Envelope.decode(part.schema.metadata[ENVELOPE].decode())
        except (OSError, ValueError) as error:
            path.unlink(missing_ok=True)
            raise CampaignError(f"{path}: damaged, removed; the same command flies these flights again") from error

    def path(self, batch: int) -> Path:
        """Return the path of the Parquet file for a batch."""
        return self.folder / f"{batch:08}.parquet"

    def _check(self, found: Campaign, where: Path) -> None:
        if difference := found.difference(self._campaign):
            raise CampaignError(
                f"{where}: holds another campaign ({difference}), expected the same one, another --out, or --restart"
            )


def read_result(path: Path) -> tuple[Campaign, Envelope]:
    """Return campaign and envelope in the metadata of a Parquet file with the results of a campaign.

    Raises:
        CampaignError: The file is missing, damaged, not the result of a campaign, or of a format not read here.
    """
    try:
        with open_regular(path):
            found = pq.read_metadata(path)
            metadata, columns = found.metadata or {}, found.schema.to_arrow_schema()
    except (DocumentError, OSError, ValueError) as error:
        raise CampaignError(f"{path}: cannot be read, expected the Parquet file of a campaign") from error
    if CAMPAIGN not in metadata:
        raise CampaignError(f"{path}: not the result of a campaign, expected a file of hsv montecarlo")
    if metadata.get(DIGEST) != result_digest(metadata):
        raise CampaignError(f"{path}: damaged, its digest is missing or wrong; expected the result of a campaign")
    if (number := metadata.get(FORMAT, b"1")) != LATEST:
        raise CampaignError(f"{path}: format {number.decode(errors='replace')!r}, expected {LATEST.decode()}")
    try:
        campaign = Campaign.from_text(metadata[CAMPAIGN].decode())
    except (CampaignError, UnicodeDecodeError) as error:
        raise CampaignError(f"{path}: {error}") from error
    try:
        for column in schema(campaign):
            lack = f"column {column.name!r}"
            if not columns.field(column.name).equals(column, check_metadata=True):
                raise KeyError
        lack = "envelope of this version's curves"
        return campaign, Envelope.decode(metadata[ENVELOPE].decode())
    except (KeyError, ValueError) as error:
        raise CampaignError(
            f"{path}: has no {lack}, written by commit {campaign.commit}; expected a result of this version"
        ) from error


def result_digest(kept: Mapping[bytes, bytes]) -> bytes:
    """Return the hexadecimal SHA-256 of the campaign and the envelope in the metadata of a result file."""
    texts = [kept.get(key, b"") for key in (CAMPAIGN, ENVELOPE)]
    return hashlib.sha256(b"".join(b"%d:%s" % (len(text), text) for text in texts)).hexdigest().encode()
