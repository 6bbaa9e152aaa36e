#!/usr/bin/env bash
# One campaign on a cluster with Slurm: every task of the array computes a shard.
#
#   job=$(sbatch --parsable examples/cluster/slurm.sh scenarios/robot-classes.toml results)
#   sbatch --dependency="afterok:$job" --wrap 'yair merge results/shard-* --out results/merged'
#
# A task that was killed, or ran out of time, goes on where it was: submit it again, alone (--array=7) or all of them.
#SBATCH --job-name=yair-sweep
#SBATCH --array=1-16
#SBATCH --cpus-per-task=8
#SBATCH --time=04:00:00
set -euo pipefail

# As many as the array has; Slurm itself forgets it for a task that is submitted again alone.
export YAIR_SHARDS="${YAIR_SHARDS:-16}"

scenario=${1:?the scenario} out=${2:?the folder for all shards}
exec yair sweep "$scenario" --shard auto --resume --jobs "${SLURM_CPUS_PER_TASK:-0}" --quiet \
  --out "$out/shard-$SLURM_ARRAY_TASK_ID" "${@:3}"
