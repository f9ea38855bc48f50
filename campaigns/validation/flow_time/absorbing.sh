#!/bin/sh
# Compute a kept case again with an outlet that lets long waves out: absorbing.sh KEPT_FOLDER NEW_FOLDER [plain | slip]
#
# The mean velocity of the water through the outlet is U + sqrt(g / d) (h - d), with the mean depth h
# at the outlet: an outgoing long wave has this ratio of velocity to height, so none comes back, and
# the level returns to d. With `plain` the outlet stays as it was, and only the gauges are added;
# with `slip` the bed slips too.
set -eu
old=$1 new=$2
export WM_PROJECT_DIR="${WM_PROJECT_DIR:-/usr/share/openfoam}" WM_PROJECT=OpenFOAM
export WM_PROJECT_VERSION="${WM_PROJECT_VERSION:-v1912}"
mkdir -p "$new"
cp -r "$old/0" "$old/constant" "$old/system" "$new/"
speed=$(sed -n 's/.*Umean \([0-9.e-]*\);.*/\1/p' "$new/0/U")
depth=$(sed -n 's/^value *\([0-9.e-]*\);.*/\1/p' "$new/constant/hRef")
width=$(awk '/^vertices/ { on = 1 } on && /\(-/ { gsub(/[()]/, ""); print -2 * $2; exit }' "$new/system/blockMeshDict")
rate=$(awk -v d="$depth" 'BEGIN { print sqrt(9.81 / d) }')
[ "${3:-}" = plain ] || sed -i "s|^ *outlet .*|    outlet { type exprFixedValue; value uniform (-$speed 0 0); valueExpr \"vector(-($speed + $rate*(sum(alpha.water*area())/$width - $depth)), 0, 0)\"; }|" "$new/0/U"
[ "${3:-}" != slip ] || sed -i 's|^ *ground .*|    ground { type slip; }|' "$new/0/U"
cd "$new"
# upstream of the vehicle: p_rgh = rho g (local depth - d), and the speed
sed -i 's|^functions$|functions_gauges|' system/controlDict
cat >> system/controlDict <<'GAUGES'
functions
{
    gauges
    {
        type probes; libs (sampling); fields (p_rgh U); interpolationScheme cell;
        probeLocations ((1.6 -2.2 0.05) (1.6 -1.1 0.05) (1.6 0 0.05) (1.6 1.1 0.05) (1.6 2.2 0.05));
        executeControl runTime; executeInterval 0.05; writeControl runTime; writeInterval 0.05;
    }
    $functions_gauges;
}
GAUGES
nice -n 19 interFoam > log.interFoam 2>&1
