"""What this package repeats of the server's sources is what they say."""

from __future__ import annotations

import csv
import dataclasses
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from servers import ROOT

import wade
from wade import shm_layout
from wade.state import SCALARS, TOLD, VECTORS
from wade.v1 import hydrodynamics_pb2

PACKAGE = Path(__file__).resolve().parents[1]
CRATES = ROOT / "crates"
LAYOUT = (CRATES / "wade-wire" / "src" / "shm" / "layout.rs").read_text()
WIRE = (CRATES / "wade-wire" / "src" / "state.rs").read_text()


def test_the_generated_files_are_those_of_proto(tmp_path: Path) -> None:
    subprocess.run([PACKAGE / "generate", tmp_path], check=True, env={**os.environ, "PYTHON": sys.executable})
    fresh = {path.name: path.read_text() for path in (tmp_path / "wade" / "v1").iterdir()}
    committed = {path.name: path.read_text() for path in (PACKAGE / "src" / "wade" / "v1").glob("*_pb2*")}
    assert fresh == committed, "run clients/python/generate"


def test_a_state_has_the_fields_of_the_message_for_batches() -> None:
    message = hydrodynamics_pb2.EvaluateBatchRequest.DESCRIPTOR
    arrays = {field.name for field in message.fields if field.is_repeated}
    assert arrays == {*SCALARS, *VECTORS, *TOLD}
    single = {field.name for field in hydrodynamics_pb2.State.DESCRIPTOR.fields}
    # an attitude is the direction of gravity here, and a session has a number over shared memory alone
    fields = {field.name for field in dataclasses.fields(wade.State)}
    assert fields == single - {"world_from_body", "roll_pitch"} | {"session"}


def members(enumeration: Any, prefix: str) -> dict[str, int]:
    named = {name.removeprefix(prefix): number for name, number in enumeration.items()}
    assert named.pop("UNSPECIFIED") == 0
    return named


def test_the_enumerations_are_those_of_the_messages() -> None:
    contacts = members(hydrodynamics_pb2.GroundContact, "GROUND_CONTACT_")
    assert {contact.name: contact.value for contact in wade.GroundContact} == contacts
    quantities = members(hydrodynamics_pb2.Quantity, "QUANTITY_")
    assert {quantity.name: quantity.value + 1 for quantity in wade.Quantity} == quantities
    effects = members(hydrodynamics_pb2.Effect, "EFFECT_")
    assert {effect.name: effect.value for effect in wade.Effect} == effects
    assert len(effects) <= shm_layout.MAX_EFFECTS
    reasons = members(hydrodynamics_pb2.LeftOut, "LEFT_OUT_")
    assert {reason.name: reason.value for reason in wade.LeftOut} == reasons
    boxed = members(hydrodynamics_pb2.BoxQuantity, "BOX_QUANTITY_")
    assert {quantity.name: quantity.value + 1 for quantity in wade.BoxQuantity} == boxed


def rust_fields(struct: str) -> list[tuple[str, str]]:
    """Names and types of a `#[repr(C)]` struct, in order."""
    body = re.search(rf"pub struct {struct} \{{(.*?)\n\}}", LAYOUT, re.DOTALL)
    assert body, struct
    return re.findall(r"^    pub (\w+): (.+),$", body.group(1), re.MULTILINE)


def rust_type(dtype: np.dtype[Any]) -> str:
    """How Rust writes a field of this type."""
    names = {"<u8": "u64", "<u4": "u32", "<f4": "f32", "|u1": "u8", "|S64": "[u8; PROVENANCE_LEN]"}
    reserved = ("RESERVED_LEN", "RESERVED_LEFT", "QUERY_RESERVED", "DESCRIPTION_LEN")
    rooms = ("MAX_SURFACES", "MAX_BATCH", "MAX_EFFECTS", "MAX_QUANTITIES", "MAX_WHEELS", "DERIVATIVES", *reserved)
    lengths = {getattr(shm_layout, room): room for room in rooms}
    structs = {shm_layout.QUERY: "Query", shm_layout.ANSWER: "Answer", shm_layout.BATCH_HEADER: "BatchHeader"}
    structs[shm_layout.EFFECT_ANSWER] = "EffectAnswer"
    structs[shm_layout.SURFACE_ANSWER] = "SurfaceAnswer"
    base = structs.get(dtype.base) or names[dtype.base.str]
    for length in reversed(dtype.shape):
        base = f"[{base}; {lengths.get(length, length)}]"
    return base


@pytest.mark.parametrize(
    ("struct", "dtype"),
    [
        ("Query", shm_layout.QUERY),
        ("EffectAnswer", shm_layout.EFFECT_ANSWER),
        ("SurfaceAnswer", shm_layout.SURFACE_ANSWER),
        ("Answer", shm_layout.ANSWER),
        ("JacobianAnswer", shm_layout.JACOBIAN_ANSWER),
        ("BatchHeader", shm_layout.BATCH_HEADER),
        ("BatchQuery", shm_layout.BATCH_QUERY),
        ("BatchAnswer", shm_layout.BATCH_ANSWER),
        ("VehicleAnswer", shm_layout.VEHICLE_ANSWER),
    ],
)
def test_the_layout_is_the_servers(struct: str, dtype: np.dtype[Any]) -> None:
    fields = [(name, rust_type(field)) for name, (field, _) in shm_layout.fields(dtype).items()]
    assert fields == rust_fields(struct)
    name = re.search(rf'#\[type_name\("(.*)"\)\]\npub struct {struct} ', LAYOUT)
    assert name
    if struct not in ("BatchHeader", "EffectAnswer", "SurfaceAnswer"):  # which lie within others
        assert getattr(shm_layout, struct).type_name() == name.group(1)


PAGES = ROOT / "tests" / "data" / "shm" / "v4"


def test_every_field_lies_where_the_first_commit_of_the_layout_put_it() -> None:
    rows = list(csv.DictReader((PAGES / "layout.csv").read_text().splitlines()))
    assert len(rows) > 60
    names = {"Query": "QUERY", "Answer": "ANSWER", "EffectAnswer": "EFFECT_ANSWER", "SurfaceAnswer": "SURFACE_ANSWER"}
    names |= {"BatchHeader": "BATCH_HEADER", "BatchQuery": "BATCH_QUERY", "BatchAnswer": "BATCH_ANSWER"}
    for row in rows:
        if row["field"] not in ("reserved", "spare"):
            field, offset = shm_layout.fields(getattr(shm_layout, names[row["struct"]]))[row["field"]]
            assert (offset, field.itemsize) == (int(row["offset"]), int(row["size"])), row


def words(value: Any) -> list[float]:
    """The numbers of a field, in order."""
    array = np.asarray(value)
    if array.dtype.fields:
        return [word for entry in array.ravel() for name in array.dtype.fields for word in words(entry[name])]
    return [float(word) for word in array.ravel()]


#: What the pages of the first day have zeros for.
_WAVE = ("wave_vector_radpm", "wave_amplitude_m", "wave_phase_rad")
LATER = ("reserved", "owner", "wheel_count", "shaft_power_w", *_WAVE, "current_exponent")


@pytest.mark.parametrize(("name", "dtype"), [("query", shm_layout.QUERY), ("answer", shm_layout.ANSWER)])
def test_a_page_of_the_first_commit_of_the_layout_says_what_it_said(name: str, dtype: np.dtype[Any]) -> None:
    page = np.frombuffer((PAGES / f"set-{name}.bin").read_bytes(), dtype)[0]
    for row, field in enumerate(shm_layout.fields(dtype)):
        if field == "provenance":
            assert page[field] == b"the first page of v4"
        elif field in LATER:
            # what got a meaning later was reserved on the first day
            assert not any(words(page[field])), field
        else:
            assert words(page[field]) == [100 * row + word for word in range(len(words(page[field])))], field


def test_what_is_unset_in_a_page_is_nan_here_too() -> None:
    query = np.frombuffer((PAGES / "unset-query.bin").read_bytes(), shm_layout.QUERY)[0]
    ours = shm_layout.UNSET_QUERY
    for field in ("heading_rad", "depth_rate_mps", "water_level_m", "bed_clearance_m", "bed"):
        assert np.isnan(query[field]) and np.isnan(ours[field]), field
    for field in ("wheel_speed_radps", "wheel_water_level_m"):
        assert np.isnan(query[field]).all() and np.isnan(ours[field]).all(), field
    assert query["flags"] == ours["flags"] == 0
    answer = np.frombuffer((PAGES / "unset-answer.bin").read_bytes(), shm_layout.ANSWER)[0]
    for field in ("moment_deviation_nm", "added_mass", "damping", "water_level_m", "bed_clearance_m", "bed"):
        assert np.isnan(answer[field]).all(), field
    assert np.isnan(answer["surfaces"]["couple_nm"]).all()


def rust_numbers(pattern: str, text: str) -> dict[str, int]:
    return {name: int(number) for name, number in re.findall(pattern, text)}


def test_the_codes_and_limits_are_the_servers() -> None:
    constants = rust_numbers(r"pub const (\w+): \w+ = ([\d_]+);", LAYOUT)
    assert {name: getattr(shm_layout, name) for name in constants} == constants
    text = (CRATES / "wade-core" / "src" / "vehicle" / "mod.rs").read_text()
    assert rust_numbers(r"pub const (MAX_SURFACES): \w+ = (\d+);", text) == {"MAX_SURFACES": shm_layout.MAX_SURFACES}
    status = rust_numbers(r"    (\w+) = (\d+),", LAYOUT)
    ours = {
        name: getattr(shm_layout, f"STATUS_{name.upper()}")
        for name in ("OK", "INVALID_STATE", "NOT_SERVED", "TOO_LONG")
    }
    assert [status[name] for name in ("Ok", "InvalidState", "NotServed", "TooLong")] == [*ours.values()]
    fields = re.search(r"pub enum Field \{(.*?)\n    \}", WIRE, re.DOTALL)
    assert fields
    named = re.findall(r"^ +\w+ = (\d+) => \"(\w+)\",$", fields.group(1), re.MULTILINE)
    assert shm_layout.FIELDS == {int(number): name for number, name in named}
    problems = re.search(r"pub enum Problem \{(.*?)\n\}", WIRE, re.DOTALL)
    assert problems
    assert list(shm_layout.PROBLEMS) == [int(n) for n in re.findall(r"\w+ = (\d+),", problems.group(1))]


def test_the_names_are_the_servers() -> None:
    version = re.search(r'pub const VERSION: &str = "(.*)";', LAYOUT)
    assert version and version.group(1) == shm_layout.VERSION
    names = re.findall(r'format!\("\{\}/(.*)", self\.namespace\)', LAYOUT.replace("{VERSION}", shm_layout.VERSION))
    ours = (
        shm_layout.evaluate_name("", "{vehicle}"),
        shm_layout.evaluate_batch_name("", "{vehicle}"),
        shm_layout.evaluate_jacobian_name("", "{vehicle}"),
        shm_layout.vehicle_name("", "{vehicle}"),
        shm_layout.served_name(""),
        shm_layout.wake_name(""),
        shm_layout.done_name(""),
    )
    assert [f"/{name}" for name in names] == list(ours)
    assert shm_layout.listener_name(0xBEEF) == "000000000000beef"
