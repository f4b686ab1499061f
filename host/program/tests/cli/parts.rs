use crate::{Folder, command, shapes, succeeds};
use std::process::Command;

/// The lines for a capture without Dask, as the documentation has them.
fn documented(start: &str) -> &'static str {
    let lines = include_str!("../../../python/README.md").lines();
    lines.into_iter().find(|line| line.starts_with(start)).expect("the documentation says how")
}

#[cfg(unix)]
#[test]
fn the_documented_lines_capture_in_parts_that_are_the_whole_together() {
    let at = &Folder::new();
    let path = at;
    shapes(path);
    succeeds(path, "capture meshes/ -o one --touches 500");
    let program = command([""; 0]).get_program().to_owned();
    // A few touches only.
    let script = format!(
        "set -euo pipefail\npalpate() {{ \"$PROGRAM\" \"$@\"; }}\nexport -f palpate\n{}\n{}\n{}\n",
        documented("export COUNT=").replace("21000", "500"),
        documented("seq 8"),
        documented("mkdir whole"),
    );
    let ran = Command::new("bash").arg("-c").arg(script).env("PROGRAM", program).current_dir(path).output().unwrap();
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    for file in ["ball.txt", "disc.txt"] {
        let read = |part: &str| std::fs::read(path.join(part).join(file)).unwrap();
        assert!(read("one") == read("whole"), "{file}");
        assert_eq!(read("whole").split(|&byte| byte == b'\n').count(), 501);
    }
    // A job of a Slurm array is one of these commands.
    let job = documented("seq 8").split('\'').nth(1).unwrap().replace("PART", "SLURM_ARRAY_TASK_ID");
    assert!(documented("sbatch").contains(&job), "{job}");
}
