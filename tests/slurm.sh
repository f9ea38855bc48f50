#!/bin/sh
# Runs a small plan through a real Slurm of one node on this machine: `tests/slurm.sh target/release/wade`.
# Needs root, OpenFOAM, and Debian's packages slurmctld, slurmd, slurm-client and munge.
set -eu
wade=$(realpath "${1:?the wade program}")
vehicles=$(realpath "$(dirname "$0")/../vehicles")
place=$(mktemp -d)
pids=""
finish() {
    for pid in $pids; do kill "$pid" 2>/dev/null || true; done
    # slurmctld writes its state once more when it ends
    for pid in $pids; do wait "$pid" 2>/dev/null || true; done
    rm -rf "$place"
}
trap finish EXIT INT TERM

mkdir -p /run/munge
[ -e /etc/munge/munge.key ] || dd if=/dev/urandom of=/etc/munge/munge.key bs=1024 count=1 status=none
chown -R munge:munge /etc/munge /run/munge /var/lib/munge /var/log/munge
chmod 400 /etc/munge/munge.key
if ! munge -n >/dev/null 2>&1; then
    runuser -u munge -- /usr/sbin/munged --foreground &
    pids="$pids $!"
fi

host=$(hostname -s)
mkdir -p "$place/state" "$place/spool"
cat >"$place/slurm.conf" <<CONF
ClusterName=wade
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=16817
SlurmdPort=16818
SlurmUser=root
AuthType=auth/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
MpiDefault=none
ReturnToService=2
StateSaveLocation=$place/state
SlurmdSpoolDir=$place/spool
SlurmctldPidFile=$place/slurmctld.pid
SlurmdPidFile=$place/slurmd.pid
SlurmctldLogFile=$place/slurmctld.log
SlurmdLogFile=$place/slurmd.log
NodeName=$host NodeAddr=127.0.0.1 CPUs=2 RealMemory=4096 State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF="$place/slurm.conf"
slurmctld -D -f "$SLURM_CONF" >"$place/ctld.out" 2>&1 &
pids="$pids $!"
slurmd -D -f "$SLURM_CONF" >"$place/slurmd.out" 2>&1 &
pids="$pids $!"
tries=0
until sinfo -h -o %t 2>/dev/null | grep -q idle; do
    tries=$((tries + 1))
    [ $tries -lt 60 ] || { cat "$place"/*.log "$place"/*.out; echo "Slurm did not start"; exit 1; }
    sleep 1
done

# three small coarse cases of half a second
cat >"$place/settings.toml" <<TOML
settle_s = [0.2, 0.2]
window_s = 0.4
windows = 1
[mesh]
cells_per_length = 3.0
channel_m = [6.0, 5.0, 1.5]
TOML
WADE_VEHICLES=$vehicles "$wade" campaign plan --vehicle husky --set paper --cases 3 --seed 5 \
    --settings "$place/settings.toml" --target slurm --out "$place/campaign"
cd "$place/campaign"
mkdir -p work/slurm
WADE=$wade WADE_VEHICLES=$vehicles sbatch --wait campaign.sbatch
done=$(ls work/outcomes | wc -l)
[ "$done" -eq 3 ] || { cat work/slurm/*.log; echo "$done of 3 cases have an outcome"; exit 1; }
echo "slurm: 3 of 3 cases computed by a job array"
