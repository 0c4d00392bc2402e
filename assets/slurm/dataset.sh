#!/usr/bin/env bash
# Makes a dataset on a Slurm cluster with a shared file system. All arguments go to `nbdtree dataset`.
#
# One job, with tasks that share the trajectories and merge them:
#     sbatch --ntasks=64 assets/slurm/dataset.sh BODY.h5 -o DATA.h5 --trajectories 2000
# Or a job array, with tasks that start as resources become free; the last line adds missing trajectories and merges:
#     job=$(sbatch --parsable --array=0-31 assets/slurm/dataset.sh BODY.h5 -o DATA.h5 --trajectories 2000)
#     sbatch --dependency=afterany:$job assets/slurm/dataset.sh BODY.h5 -o DATA.h5 --trajectories 2000
# After a time limit, a failed node or a cancelled job, submit the same again. NBDTREE is the path of the program.
#SBATCH --job-name=nbdtree-dataset
#SBATCH --cpus-per-task=2
#SBATCH --mem-per-cpu=1G
#SBATCH --time=04:00:00
#SBATCH --signal=INT@30
#SBATCH --requeue
set -euo pipefail
nbdtree=${NBDTREE:-nbdtree}
threads=${SLURM_CPUS_PER_TASK:-2}

if [ -n "${SLURM_ARRAY_TASK_ID:-}" ]; then
    exec "$nbdtree" dataset "$@" --threads "$threads" \
        --shard "$((SLURM_ARRAY_TASK_ID - SLURM_ARRAY_TASK_MIN))/$SLURM_ARRAY_TASK_COUNT"
fi
if command -v srun >/dev/null; then
    exec srun --kill-on-bad-exit=0 "$nbdtree" dataset "$@" --threads "$threads"
fi
exec mpirun --enable-recovery "$nbdtree" dataset "$@" --threads "$threads"
