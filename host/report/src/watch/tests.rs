use super::*;
use crate::small::model;

#[test]
fn a_page_holds_everything_itself_is_small_and_names_cannot_break_out_of_it() {
    for model in [None, Some(model(["</script><script>alert(1)</script>", "<b>"]))] {
        let page = page(model.as_ref(), "palpate watch -o '<i>.html'").unwrap();
        assert!(page.len() < 150_000, "{} bytes", page.len());
        assert!(!page.contains("<script>alert") && !page.contains("<b>") && !page.contains("<i>"));
        for part in ["http:", "https:", "url(", "@import", "src=\"", "fetch(", "import("] {
            assert!(!page.contains(part), "{part}");
        }
        assert!(page.contains("default-src 'none'") && page.contains("'wasm-unsafe-eval'"));
        assert_eq!(page.contains("The line marks the threshold"), model.is_some());
    }
}

#[test]
fn a_page_states_a_models_checksum_and_the_posterior_that_it_stops_at() {
    let model = model(["cup", "bowl"]);
    let stated = stated(&model);
    assert_eq!(stated["checksum"], model.model().checksum());
    assert_eq!(stated["objects"], serde_json::json!(["cup", "bowl"]));
    let error_rate = Stopping::from_model(&model.model()).error_rate();
    for threshold in stated["thresholds"].as_array().unwrap() {
        assert!((threshold.as_f64().unwrap() - (1.0 - error_rate)).abs() < 1e-6, "{threshold}, {error_rate}");
    }
}
