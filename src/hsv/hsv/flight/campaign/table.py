"""The table of a campaign's results: one row per flight, units in the columns' metadata."""

from __future__ import annotations

from io import BytesIO
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from hsv.flight.campaign.campaign import Campaign
from hsv.flight.campaign.envelope import Envelope
from hsv.flight.metrics import METRICS

CAMPAIGN, ENVELOPE, DIGEST = b"hsv.campaign", b"hsv.envelope", b"hsv.digest"
"""Keys of the file's metadata."""

OUTCOMES = {"end_time": "s", "tube_level": "1", **{name: metric.unit for name, metric in METRICS.items()}}
"""The recorded numbers of a flight, with their SI units; null if a flight does not define one."""

WRITTEN: dict[str, Any] = {"compression": "zstd", "write_page_checksum": True}
"""Options of the result file; the checksums detect damage that decompresses without an error."""

_BATCH_WRITTEN: dict[str, Any] = {
    "compression": "none",
    "use_dictionary": False,
    "write_statistics": False,
    "write_page_checksum": True,
}
"""Options of a batch, which is read once and removed: compressing it takes longer than writing it."""


def schema(campaign: Campaign) -> pa.Schema:
    """Return the columns: flight, seed, sample, end, metrics, fingerprint."""
    samples = [_number(f"sample_{factor.name}", factor.unit) for factor in campaign.factors]
    outcomes = [_number(name, unit) for name, unit in OUTCOMES.items()]
    fixed = [pa.field("flight", pa.int64(), False), pa.field("seed", pa.uint64(), False)]
    ended = [pa.field("diverged", pa.bool_(), False), pa.field("crashed", pa.string())]
    return pa.schema([*fixed, *samples, *ended, *outcomes, pa.field("fingerprint", pa.string())])


def _number(name: str, unit: str) -> pa.Field:
    return pa.field(name, pa.float64(), metadata={"unit": unit})


def encode(campaign: Campaign, rows: list[dict[str, Any]], envelope: Envelope) -> bytes:
    """Return rows and envelope of a batch as a Parquet file."""
    table = pa.Table.from_pylist(rows, schema=schema(campaign).with_metadata({ENVELOPE: envelope.encode()}))
    stream = BytesIO()
    pq.write_table(table, stream, **_BATCH_WRITTEN)
    return stream.getvalue()
