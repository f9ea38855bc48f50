#!/bin/sh
# Compute one mesh: run.sh FOLDER [options of case.py]; the history of the force is FOLDER/force.csv.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
export WM_PROJECT_DIR="${WM_PROJECT_DIR:-/usr/share/openfoam}" WM_PROJECT=OpenFOAM
export WM_PROJECT_VERSION="${WM_PROJECT_VERSION:-v1912}"
folder=$1
python3 "$here/case.py" "$@"
case "$*" in *"--solver iso"*) solver=interIsoFoam ;; *) solver=interFoam ;; esac
cd "$folder"
nice -n 19 blockMesh > log.blockMesh 2>&1
nice -n 19 "$solver" > log.solver 2>&1
python3 "$here/figures.py" --extract .
