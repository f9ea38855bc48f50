"""The committed data sets open in DuckDB, with their units and provenance."""

from __future__ import annotations

import json

import duckdb
import pytest
from servers import ROOT


@pytest.mark.parametrize("vehicle", ["husky", "warthog"])
def test_duckdb_reads_a_campaign(vehicle: str) -> None:
    sections = ROOT / "campaigns" / vehicle / "sections.parquet"
    query = """
        select "case", avg(fx), avg(fz) from (
            select "case", section, sum(fx_n) as fx, sum(fz_n - rest_fz_n) as fz
            from read_parquet(?) where "set" = 'ahead' and image = 'original' group by all
        ) group by all order by all
    """
    drag = duckdb.execute(query, [str(sections)]).fetchall()
    assert len(drag) == 18
    assert all(fx < 0 for _, fx, _ in drag), "straight ahead the water pulls backwards"
    cases = duckdb.execute(
        "select id, fx_n from read_csv(?) where \"set\" = 'ahead' order by id", [str(sections.with_name("cases.csv"))]
    ).fetchall()
    assert [name for name, *_ in drag] == [name for name, _ in cases]
    for (_, mean, _), (_, stated) in zip(drag, cases, strict=True):
        assert mean == pytest.approx(stated, abs=0.5e-4), "cases.csv has four places"


def test_the_meta_data_carry_units_and_provenance() -> None:
    sections = ROOT / "campaigns" / "husky" / "sections.parquet"
    pairs = duckdb.execute("select key, value from parquet_kv_metadata(?)", [str(sections)]).fetchall()
    meta = {key.decode(): value.decode() for key, value in pairs}
    units = json.loads(meta["wade.units"])
    assert (units["fx_n"], units["vx_mps"], units["depth_m"]) == ("N", "m/s", "m")
    assert "openfoam" in json.loads(meta["wade.meta"])["provenance"]
