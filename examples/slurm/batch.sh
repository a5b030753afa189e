#!/bin/sh
# A batch on a Slurm cluster: as many jobs as the array has, each with its share of the campaigns.
#
#   sbatch --array=1-16 examples/slurm/batch.sh campaigns.csv answers
#
# The list, its files and the folder must be seen by all nodes. What a job had done when its time was over is
# kept: the same line again goes on. Keep the number of jobs: a folder holds one way of sharing.
#SBATCH --job-name=errsep
#SBATCH --cpus-per-task=4
#SBATCH --time=04:00:00
set -eu
[ $# = 2 ] || { echo "usage: sbatch --array=1-N $0 CAMPAIGNS.csv DIR" >&2; exit 2; }
: "${SLURM_ARRAY_TASK_ID:?submit it as an array: sbatch --array=1-N}"
# Tasks are counted from 1, whatever number the array begins with.
share=$((SLURM_ARRAY_TASK_ID - SLURM_ARRAY_TASK_MIN + 1))
exec errsep batch "$1" --out "$2" --quiet \
    --shard "$share/$SLURM_ARRAY_TASK_COUNT" --jobs "${SLURM_CPUS_PER_TASK:-1}"
