//! A job array for Slurm: each task runs one case of the plan with the same command as anybody.

use std::path::{Path, PathBuf};

use super::plan::{PLAN_FILE, Plan};

/// File of the job array in the folder of the campaign.
pub const JOB_FILE: &str = "campaign.sbatch";

/// Memory of one case on cells of the settings' size with room, and of as many cells again [MiB].
const MEMORY_MIB: (f64, f64) = (2048.0, 256.0);
/// Tasks at a time, so that a large plan does not take a whole cluster.
const AT_A_TIME: usize = 64;

/// The batch script for every case of a plan; submitted from the folder of the campaign.
pub fn job_array(plan: &Plan) -> String {
    let last = plan.cases.len().saturating_sub(1);
    let vehicle = &plan.campaign.vehicle;
    let finest = plan.cases.iter().map(|case| case.cell_scale).fold(1.0, f64::min);
    let minutes = (plan.campaign.settings.limit(finest) * 2.0 / 60.0).ceil() as u64 + 5;
    let (base, more) = MEMORY_MIB;
    let memory_mib = (base + more * (finest.powi(-3) - 1.0)).ceil() as u64;
    format!(
        "#!/bin/sh
# One task a case of {PLAN_FILE}. Submit from this folder:
#   mkdir -p work/slurm && sbatch {JOB_FILE}
# WADE names the program where it is not on the path of the nodes, WADE_VEHICLES the folder of the bundles. A case
# that is done is left alone, so that the array may be submitted again after a node was lost.
#SBATCH --job-name=wade-{vehicle}
#SBATCH --array=0-{last}%{AT_A_TIME}
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=1
#SBATCH --mem={memory_mib}M
#SBATCH --time={minutes}
#SBATCH --output=work/slurm/%a.log
set -eu
# line 1 holds the names of the columns
case=$(sed -n \"$((SLURM_ARRAY_TASK_ID + 2))p\" {PLAN_FILE} | cut -d, -f1)
exec \"${{WADE:-wade}}\" campaign run . --case \"$case\" --jobs 1
"
    )
}

/// Writes the job array beside the plan and says where.
pub fn write(folder: &Path, plan: &Plan) -> std::io::Result<PathBuf> {
    let path = folder.join(JOB_FILE);
    std::fs::write(&path, job_array(plan))?;
    Ok(path)
}
