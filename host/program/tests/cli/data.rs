use crate::{Folder, complains, fails, figures, globe, palpate, says, succeeds};

#[test]
fn a_data_set_is_summed_up_and_one_that_would_train_badly_ends_with_1() {
    let at = &Folder::new();
    ["bowl", "fork"].into_iter().zip([4, 5]).for_each(|(name, rings)| _ = globe(at, name, rings));
    succeeds(at, "capture bowl.obj fork.obj --touches 120 -o touches");
    let check = "data check touches";
    let expected = ["bowl", "fork", "curvature", "slope", "probe: radius 0.15 units", "2 objects, 240 touches"];
    says(at, check, &expected);
    let read = figures(at, check);
    assert_eq!(read["summary"]["objects"][1]["patterns"], serde_json::json!([0, 0, 0, 0, 0, 120]));
    assert_eq!(read["findings"], serde_json::json!([]));
    let fork = at.join("touches/fork.txt");
    let text = std::fs::read_to_string(&fork).unwrap();
    std::fs::write(&fork, text.replacen("0.", "0,x", 1)).unwrap();
    let output = palpate(at, check);
    let listed = String::from_utf8_lossy(&output.stdout);
    assert!(listed.contains("wrong: ") && listed.contains("fork.txt:1: "), "{listed}");
    complains(output, check, 1, "training on these touches would be wrong, for 1 reason. Correct");
    fails(at, "data check", 2, "");
    complains(palpate(at, "data check nowhere"), "data check nowhere", 1, "");
}
