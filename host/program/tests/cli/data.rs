use crate::{command, globe, json, stderr, stdout, succeeds};

#[test]
fn a_data_set_is_summed_up_and_one_that_would_train_badly_ends_with_1() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("touches");
    ["bowl", "fork"].into_iter().zip([4, 5]).for_each(|(name, rings)| _ = globe(directory.path(), name, rings));
    succeeds(directory.path(), "capture bowl.obj fork.obj --touches 120 -o touches");
    let check = || command(["data", "check"]).arg(&out).output().unwrap();
    let said = stdout(check());
    for expected in ["bowl", "fork", "curvature", "slope", "probe: radius 0.15 units", "2 objects, 240 touches"] {
        assert!(said.contains(expected), "{said}");
    }
    let read = json(command(["data", "check", "--json"]).arg(&out).output().unwrap());
    assert_eq!(read["summary"]["objects"][1]["patterns"], serde_json::json!([0, 0, 0, 0, 0, 120]));
    assert_eq!(read["findings"], serde_json::json!([]));
    let text = std::fs::read_to_string(out.join("fork.txt")).unwrap();
    std::fs::write(out.join("fork.txt"), text.replacen("0.", "0,x", 1)).unwrap();
    let output = check();
    let listed = String::from_utf8(output.stdout.clone()).unwrap();
    assert!(listed.contains("wrong: ") && listed.contains("fork.txt:1: "), "{listed}");
    let error = stderr(output, 1);
    assert!(error.contains("training on these touches would be wrong, for 1 reason. Correct"), "{error}");
    stderr(command(["data", "check"]).output().unwrap(), 2);
    stderr(command(["data", "check", "nowhere"]).output().unwrap(), 1);
}
