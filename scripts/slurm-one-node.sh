#!/usr/bin/env bash
# Runs a command beside a Slurm cluster of this one machine. The cluster lives as long as the command, and needs neither
# root nor systemd nor munge. For tests alone: anybody on the machine may send jobs to it.
#
# usage: scripts/slurm-one-node.sh FOLDER COMMAND...
# FOLDER: a place for the cluster's own files; lines in FOLDER/extra.conf are added to its configuration.
# The exit code is the command's, or 69 where the cluster did not come up.
set -euo pipefail
PATH=$PATH:/usr/sbin:/sbin
mkdir -p "$1"
place=$(cd "$1" && pwd)
shift
host=$(hostname -s)
user=$(id -un)
processors=$(nproc)
mkdir -p "$place/state" "$place/spool"

# A port of the loopback interface at which nobody answers.
free_port() {
    local port
    while port=$((20000 + RANDOM % 10000)); (exec 3<>"/dev/tcp/127.0.0.1/$port") 2>/dev/null; do :; done
    echo "$port"
}

cat >"$place/slurm.conf" <<CONFIGURATION
ClusterName=one-node
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$(free_port)
SlurmdPort=$(free_port)
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/none
CredType=cred/none
StateSaveLocation=$place/state
SlurmdSpoolDir=$place/spool
SlurmctldPidFile=$place/slurmctld.pid
SlurmdPidFile=$place/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/affinity
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
MailProg=/bin/true
ReturnToService=2
KillWait=3
SchedulerParameters=sched_interval=1,batch_sched_delay=0
NodeName=$host NodeAddr=127.0.0.1 CPUs=$processors Boards=1 SocketsPerBoard=1 CoresPerSocket=$processors ThreadsPerCore=1
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONFIGURATION
if [ -e "$place/extra.conf" ]; then cat "$place/extra.conf" >>"$place/slurm.conf"; fi
export SLURM_CONF="$place/slurm.conf"

daemons=()
stop() {
    # Jobs outlive the daemons, so they go first.
    timeout 5 scancel --user="$user" 2>/dev/null || true
    for _ in $(seq 25); do
        [ -n "$(timeout 5 squeue --noheader 2>/dev/null)" ] || break
        sleep 0.2
    done
    for daemon in "${daemons[@]}"; do
        kill "$daemon" 2>/dev/null || true
        wait "$daemon" 2>/dev/null || true
    done
}
trap stop EXIT
trap 'exit 143' INT TERM HUP

# Waits until a question to the cluster has the expected answer.
until_says() {
    local expected=$1
    shift
    for _ in $(seq 100); do
        [[ "$(timeout 5 "$@" 2>/dev/null)" == $expected ]] && return
        sleep 0.1
    done
    echo "the cluster does not come up; see $place" >&2
    exit 69
}

# The daemons keep nothing of ours open, so that a pipe to this script ends with it.
slurmctld -D </dev/null >"$place/slurmctld.log" 2>&1 &
daemons=($!)
until_says '?*' sinfo --noheader
slurmd -D </dev/null >"$place/slurmd.log" 2>&1 &
daemons=($! "${daemons[@]}")
until_says idle sinfo --noheader --format=%t

"$@" <&0 &
command=$!
daemons=("$command" "${daemons[@]}")
code=0
wait "$command" || code=$?
exit "$code"
