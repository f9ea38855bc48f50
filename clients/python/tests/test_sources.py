"""What this package repeats of the server's sources is what they say."""

from __future__ import annotations

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
LAYOUT = (ROOT / "src" / "service" / "shm_layout.rs").read_text()
WIRE = (ROOT / "src" / "service" / "wire.rs").read_text()


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
    fields = {*wade.State.__dataclass_fields__}
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
    assert len(effects) == shm_layout.PHYSICS
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
    names = {"<u8": "u64", "<u4": "u32", "<f4": "f32", "|S32": "[u8; PROVENANCE_LEN]"}
    lengths = {shm_layout.MAX_SURFACES: "MAX_SURFACES", shm_layout.MAX_BATCH: "MAX_BATCH"}
    lengths[shm_layout.PHYSICS] = "PHYSICS"
    structs = {shm_layout.QUERY: "Query", shm_layout.ANSWER: "Answer", shm_layout.BATCH_HEADER: "BatchHeader"}
    structs[shm_layout.EFFECT_ANSWER] = "EffectAnswer"
    base = structs.get(dtype.base) or names[dtype.base.str]
    for length in reversed(dtype.shape):
        base = f"[{base}; {lengths.get(length, length)}]"
    return base


@pytest.mark.parametrize(
    ("struct", "dtype"),
    [
        ("Query", shm_layout.QUERY),
        ("EffectAnswer", shm_layout.EFFECT_ANSWER),
        ("Answer", shm_layout.ANSWER),
        ("BatchHeader", shm_layout.BATCH_HEADER),
        ("BatchQuery", shm_layout.BATCH_QUERY),
        ("BatchAnswer", shm_layout.BATCH_ANSWER),
    ],
)
def test_the_layout_is_the_servers(struct: str, dtype: np.dtype[Any]) -> None:
    fields = [(name, rust_type(field)) for name, (field, _) in shm_layout.fields(dtype).items()]
    assert fields == rust_fields(struct)
    name = re.search(rf'#\[type_name\("(.*)"\)\]\npub struct {struct} ', LAYOUT)
    assert name
    if struct not in ("BatchHeader", "EffectAnswer"):  # which lie within others
        assert getattr(shm_layout, struct).type_name() == name.group(1)


def rust_numbers(pattern: str, text: str) -> dict[str, int]:
    return {name: int(number) for name, number in re.findall(pattern, text)}


def test_the_codes_and_limits_are_the_servers() -> None:
    constants = rust_numbers(r"pub const (\w+): \w+ = (\d+);", LAYOUT)
    assert {name: getattr(shm_layout, name) for name in constants if name != "PROVENANCE_LEN"} == {
        name: number for name, number in constants.items() if name != "PROVENANCE_LEN"
    }
    surfaces = (ROOT / "src" / "vehicle.rs", ROOT / "src" / "vehicle" / "mod.rs")
    text = "".join(path.read_text() for path in surfaces if path.exists())
    assert rust_numbers(r"pub const (MAX_SURFACES): \w+ = (\d+);", text) == {"MAX_SURFACES": shm_layout.MAX_SURFACES}
    status = rust_numbers(r"    (\w+) = (\d+),", LAYOUT)
    assert (status["Ok"], status["InvalidState"]) == (shm_layout.STATUS_OK, shm_layout.STATUS_INVALID_STATE)
    fields = re.search(r"pub enum Field \{(.*?)\n\}", WIRE, re.DOTALL)
    assert fields
    assert shm_layout.FIELDS == {
        int(n): name for name, n in re.findall(r"/// `(\w+)`\n    \w+ = (\d+),", fields.group(1))
    }
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
        shm_layout.served_name(""),
        shm_layout.wake_name(""),
        shm_layout.done_name(""),
    )
    assert [f"/{name}" for name in names] == list(ours)
    assert shm_layout.listener_name(0xBEEF) == "000000000000beef"
