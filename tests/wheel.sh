#!/usr/bin/env bash
# Builds the wheel with the server inside and uses it as its user would: a fresh virtual environment without cargo in PATH and
# without an index, `pip install`, `wade serve`, a query from the shell and one from Python.
#
#     tests/wheel.sh
#     tests/wheel.sh build FOLDER    builds it alone, to be used with WADE_WHEEL
#
# WADE_WHEEL_PROFILE: cargo's profile (default release). Of release alone the program must be stripped and small.
# WADE_WHEEL: a wheel that is built already.
set -euo pipefail
cd "$(dirname "$0")/.."
profile=${WADE_WHEEL_PROFILE:-release}
# bytes of the program in the wheel, and seconds from pip install to the answer
max_bytes=33000000
max_seconds=60
tools=${WADE_WHEEL_TOOLS:-$PWD/target/wheel-tools}
work=$(mktemp -d)
server=
trap '[ -z "$server" ] || { kill "$server" && wait "$server"; } 2>/dev/null || true; rm -rf "$work"' EXIT

fail() { echo "wheel: $*" >&2; exit 1; }

echo "-- build"
[ -x "$tools/bin/maturin" ] || { python3 -m venv "$tools" && "$tools/bin/pip" install --quiet --disable-pip-version-check maturin==1.16.0; }
mkdir "$work/dist"
if [ -n "${WADE_WHEEL:-}" ]; then
    cp "$WADE_WHEEL" "$work/dist/"
else
    (cd deploy/wheel && "$tools/bin/maturin" build --quiet --profile "$profile" --target-dir ../../target --out "$work/dist")
fi
if [ "${1:-}" = build ]; then
    mkdir -p "$2"
    cp "$work"/dist/wade-*.whl "$2/"
    exit
fi
wheel=$(echo "$work"/dist/wade-*.whl)
[ -f "$wheel" ] || fail "maturin left no wheel in $work/dist"
echo "$(basename "$wheel"): $(stat -c %s "$wheel") bytes"

echo "-- what is in it"
python3 -m zipfile -e "$wheel" "$work/unpacked"
program=$(echo "$work"/unpacked/wade-*.data/scripts/wade)
[ -f "$program" ] || fail "no program in the wheel"
[ -f "$work/unpacked/wade/client.py" ] || fail "no Python client in the wheel"
bytes=$(stat -c %s "$program")
echo "program: $bytes bytes"
if [ "$profile" = release ]; then
    if readelf --sections "$program" | grep -qE '\.(symtab|debug_info)'; then fail "the program is not stripped"; fi
    [ "$bytes" -le "$max_bytes" ] || fail "the program has $bytes bytes, more than $max_bytes"
fi
for file in deploy/wheel clients/python; do
    python3 - "$file/pyproject.toml" <<'PY'
import sys, tomllib
project = tomllib.load(open(sys.argv[1], "rb"))["project"]
print(project["version"], sorted(project["dependencies"]))
PY
done | sort -u | { [ "$(wc -l)" = 1 ]; } || fail "deploy/wheel and clients/python differ in version or dependencies"

echo "-- the wheels it depends on"
"$tools/bin/pip" wheel --quiet --disable-pip-version-check --only-binary :all: --wheel-dir "$work/dist" \
    $(python3 -c 'import tomllib; print(*(f"{d.split(chr(59))[0]}" for d in tomllib.load(open("deploy/wheel/pyproject.toml","rb"))["project"]["dependencies"]))')

echo "-- a changed wheel is refused by its digest"
digest=$(sha256sum "$wheel" | cut -d' ' -f1)
echo "wade==0.2.0 --hash=sha256:$digest" > "$work/requirements.txt"
python3 -m venv "$work/strict"
strict() { "$work/strict/bin/pip" install --quiet --disable-pip-version-check --no-index --no-deps --require-hashes --find-links "$1" -r "$work/requirements.txt"; }
mkdir "$work/tampered"
cp "$wheel" "$work/tampered/"
# one byte in the middle of the program
python3 - "$work/tampered/$(basename "$wheel")" <<'PY'
import sys
with open(sys.argv[1], "r+b") as file:
    file.seek(1_000_000)
    byte = file.read(1)
    file.seek(1_000_000)
    file.write(bytes([byte[0] ^ 1]))
PY
if strict "$work/tampered" 2> "$work/refusal"; then fail "a changed wheel was installed"; fi
grep -q "DO NOT MATCH THE HASHES" "$work/refusal" || { cat "$work/refusal"; fail "a changed wheel was refused for another reason"; }
strict "$work/dist" || fail "the wheel itself was refused"

echo "-- install, serve, ask"
python3 -m venv "$work/fresh"
mkdir "$work/home" "$work/elsewhere"
cd "$work/elsewhere"
port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
# nothing of ours: no cargo, no index, no settings
bare=(env -i PATH="$work/fresh/bin:/usr/bin:/bin" HOME="$work/home" PIP_NO_INDEX=1)
"${bare[@]}" sh -c 'command -v cargo' && fail "cargo is in PATH"
start=$(date +%s)
"${bare[@]}" pip install --quiet --disable-pip-version-check --no-index --find-links "$work/dist" wade
"${bare[@]}" wade serve --listen "127.0.0.1:$port" --unix-socket "$work/wade.sock" --http "" --namespace "wheel-$$" 2> "$work/log" &
server=$!
query=(wade query --vehicle husky --speed 0.8 --depth 0.18 --json)
until "${bare[@]}" "${query[@]}" --addr "http://127.0.0.1:$port" > "$work/served.json" 2> "$work/refusal"; do
    kill -0 "$server" 2>/dev/null || { cat "$work/log"; fail "the server ended"; }
    [ $(($(date +%s) - start)) -lt "$max_seconds" ] || { cat "$work/log" "$work/refusal"; fail "no answer within $max_seconds s"; }
    sleep 0.1
done
"${bare[@]}" python - "$port" "$work/served.json" <<'PY'
import json, sys
import numpy as np
import wade

with wade.GrpcClient(f"127.0.0.1:{sys.argv[1]}") as client:
    assert client.vehicles() == ["husky", "warthog"], client.vehicles()
    forces = client.evaluate("husky", wade.State(depth_m=0.18, velocity_mps=(0.8, 0, 0)))
served = json.load(open(sys.argv[2]))["wrench"]
force = served.get("force_n", served.get("force"))
force = [force[axis] for axis in "xyz"] if isinstance(force, dict) else force
np.testing.assert_array_equal(np.asarray(force, np.float32), np.asarray(forces.force_n, np.float32))
print("Fx, Fy, Fz [N]:", *forces.force_n.round(1))
PY
seconds=$(($(date +%s) - start))
echo "answered $seconds s after pip install began"
[ "$seconds" -le "$max_seconds" ] || fail "more than $max_seconds s"
grep -q 'carried by the binary' "$work/log" || { cat "$work/log"; fail "the log does not say where the vehicles are from"; }
[ -z "$(ls -A "$work/home" "$work/elsewhere" | grep -v -e : -e '^$')" ] || fail "files were left in the home or the working directory"
echo "wheel: ok"
