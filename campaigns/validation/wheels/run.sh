#!/bin/sh
# Compute the Warthog with three forms of wheel: run.sh FOLDER [ids of cases]. WADE names the program.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../../.." && pwd)
wade=${WADE:-wade}
work=$1
for form in ${FORMS:-shipped rounded cylinder}; do
    mkdir -p "$work"
    python3 "$here/make_hull.py" "$root/vehicles/warthog/hull.stl" "$work/$form.stl" "$form"
    [ -d "$work/bundles_$form" ] || "$wade" vehicle build --stl "$work/$form.stl" \
        --spec "$root/vehicles/warthog/spec.toml" --out "$work/bundles_$form/warthog"
    if [ ! -d "$work/$form" ]; then
        "$wade" campaign plan --vehicle warthog --vehicles "$work/bundles_$form" --set check \
            --settings "$here/settings.toml" --out "$work/$form"
        cp "$here/plan.csv" "$work/$form/plan.csv"
    fi
    for id in ${CASES:-warthog-check-0000 warthog-check-0001}; do
        nice -n 19 "$wade" campaign run "$work/$form" --vehicles "$work/bundles_$form" --jobs 1 \
            --work "$work/$form/work" --case "$id"
    done
done
