#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# slurm.sh BUILD DIR — Debian's slurm-wlm on this one node, everything of it in DIR: tools/fleet.slurm must fit a drawn fleet, go on after its job was
# cancelled, and end with the rows of `beamfit fleet`. Needs root. Status 77 where Slurm is not installed.
set -eu
build=$(realpath "${1:?slurm.sh BUILD DIR}")
mkdir -p "${2:?slurm.sh BUILD DIR}"
dir=$(realpath "$2") top=$(cd "$(dirname "$0")/../.." && pwd)
for program in slurmctld slurmd munged sbatch mpirun; do
    command -v $program >/dev/null || { echo "SKIPPED: $program is missing (apt-get install slurm-wlm munge openmpi-bin)"; exit 77; }
done
[ "$(id -u)" -eq 0 ] || { echo "SKIPPED: only root starts Slurm's daemons"; exit 77; }

rm -rf "$dir/state" "$dir/spool" "$dir"/*.log "$dir"/*.sqlite
mkdir -p "$dir/state" "$dir/spool"
chmod 755 "$dir"
host=$(hostname -s)
head -c 128 /dev/urandom >"$dir/munge.key"
chmod 400 "$dir/munge.key"
cat >"$dir/slurm.conf" <<END
ClusterName=one
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=16817
SlurmdPort=16818
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$dir/munge.socket
CredType=cred/munge
StateSaveLocation=$dir/state
SlurmdSpoolDir=$dir/spool
SlurmctldPidFile=$dir/slurmctld.pid
SlurmdPidFile=$dir/slurmd.pid
SlurmctldLogFile=$dir/slurmctld.log
SlurmdLogFile=$dir/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
MpiDefault=none
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP OverSubscribe=FORCE:2
END
export SLURM_CONF=$dir/slurm.conf
daemons=()
stop() {
    for pid in "${daemons[@]}"; do kill "$pid" 2>/dev/null || :; done
    wait
}
trap stop EXIT
munged --foreground --force --key-file "$dir/munge.key" --socket "$dir/munge.socket" --pid-file "$dir/munge.pid" --seed-file "$dir/munge.seed" \
    --log-file "$dir/munged.log" >"$dir/munged.out" 2>&1 &
daemons+=($!)
for _ in $(seq 100); do [ -S "$dir/munge.socket" ] && break; sleep 0.1; done
slurmctld -D -f "$SLURM_CONF" >"$dir/ctld.out" 2>&1 &
daemons+=($!)
slurmd -D -f "$SLURM_CONF" -N "$host" >"$dir/slurmd.out" 2>&1 &
daemons+=($!)
for _ in $(seq 300); do sinfo -h -o %T 2>/dev/null | grep -q idle && break; sleep 0.1; done
sinfo

cd "$dir"
python3 -B "$top/tests/fleet/draw.py" . --build "$build" --units 30 --broken 1 --duration 1
"$build/beamfit" fleet units.csv -o local.sqlite >/dev/null
export BEAMFIT_FLEET=$build/beamfit-fleet BEAMFIT_MPIRUN='--oversubscribe' OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
job=$(sbatch --parsable --ntasks=2 --output=job.log "$top/tools/fleet.slurm" units.csv slurm.sqlite)
for _ in $(seq 300); do squeue -h -o %T 2>/dev/null | grep -q RUNNING && break; sleep 0.1; done
sleep 1.5
scancel "$job"
for _ in $(seq 300); do [ -z "$(squeue -h 2>/dev/null)" ] && break; sleep 0.1; done
sbatch --wait --ntasks=2 --output=job.log "$top/tools/fleet.slurm" units.csv slurm.sqlite >/dev/null
cat job.log
BEAMFIT=$build/beamfit TOP=$top PYTHONPATH=$top/tests/system python3 -B -c 'import fleet; fleet.same("local.sqlite", "slurm.sqlite")'
echo "rows of the job that was cancelled and went on: those of beamfit fleet"
