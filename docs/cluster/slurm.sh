#!/bin/bash
# A sweep as an array job of Slurm: sbatch slurm.sh STUDY STORE
# Each task computes its part into the store; a task that is ended and queued again goes on
# where it stood. Then: sbatch --dependency=afterany:JOB --wrap "taxel sweep STUDY --store STORE --merge -o all.csv"
#SBATCH --array=0-15
#SBATCH --requeue
#SBATCH --signal=B:TERM@60
exec taxel sweep "$1" --store "$2" --shard auto
