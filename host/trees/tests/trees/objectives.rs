//! Every objective that the importers know, with what a model of it predicts.

use crate::fixtures::{assert_says, fixture, parsed};
use palpate_trees::ensemble::{Ensemble, Probability};
use palpate_trees::shared::format::Link::{self, Exponential, Identity, Logistic, Softplus, Square};

const LOGIT: f32 = -0.847_297_85;
const LOG: f32 = -1.203_972_8;

/// XGBoost's objectives of one output, the number of objects, the link, and the margin that trees start from at 0.3.
const XGBOOST: [(&str, usize, Link, f32); 6] = [
    ("binary:logistic", 2, Identity, LOGIT),
    ("binary:logitraw binary:hinge", 2, Identity, 0.3),
    ("reg:logistic", 1, Logistic, LOGIT),
    ("count:poisson reg:gamma reg:tweedie survival:cox survival:aft", 1, Exponential, LOG),
    ("reg:squarederror reg:linear reg:squaredlogerror reg:pseudohubererror reg:absoluteerror", 1, Identity, 0.3),
    ("reg:quantileerror reg:expectileerror rank:pairwise rank:ndcg rank:map", 1, Identity, 0.3),
];

/// LightGBM's objectives of one output that may learn the roots of their targets, which it then writes after them.
const WITH_ROOTS: &str = "regression regression_l1 huber fair quantile mape";

/// The others.
const LIGHTGBM: [(&str, usize, Link); 5] = [
    ("binary", 2, Identity),
    ("poisson gamma tweedie", 1, Exponential),
    ("cross_entropy", 1, Logistic),
    ("cross_entropy_lambda", 1, Softplus),
    ("lambdarank rank_xendcg", 1, Identity),
];

/// CatBoost's losses of one output for models without names of classes, as its `predict` gives them by default.
const CATBOOST: [(&str, usize, Link); 3] = [
    ("RMSE MAE MAPE Quantile LogLinQuantile Huber Expectile Lq Cox", 1, Identity),
    ("Poisson Tweedie", 1, Exponential),
    ("Logloss CrossEntropy", 2, Identity),
];

/// Fixture with some words of its file replaced; each stands there once.
fn changed(name: &str, words: [&str; 2]) -> Result<Ensemble, String> {
    let text = String::from_utf8(fixture(name).bytes()).unwrap();
    assert_eq!(text.matches(words[0]).count(), 1, "{name}: {}", words[0]);
    let text = text.replace(words[0], words[1]);
    parsed("model", text.as_bytes()).map_err(|error| error.to_string())
}

/// Number of its objects, its link and its probabilities.
fn meaning(ensemble: &Ensemble) -> (usize, Link, Probability) {
    let probability = ensemble.origin.imported.as_ref().unwrap().probability;
    (ensemble.objects.len(), ensemble.prediction().link, probability)
}

#[test]
fn each_objective_of_xgboost_has_its_link_and_the_margin_that_its_trees_start_from() {
    let all = XGBOOST.into_iter().flat_map(|(names, objects, link, start)| {
        names.split(' ').map(move |objective| (objective, objects, link, start))
    });
    for (objective, objects, link, start) in all {
        let ensemble = changed("xgboost-3.2-binary", ["binary:logistic", objective]).unwrap();
        // Its margins only say which class.
        let probability = if objective == "binary:hinge" { Probability::Unknown } else { Probability::Softmax };
        assert_eq!(meaning(&ensemble), (objects, link, probability), "{objective}");
        let found = *ensemble.base_margins.last().unwrap();
        assert!((found - start).abs() <= 1e-6, "{objective}: {found}");
    }
    for objective in ["multi:softmax", "multi:softprob"] {
        let ensemble = changed("xgboost-3.4-softmax", ["multi:softmax", objective]).unwrap();
        assert_eq!(meaning(&ensemble), (3, Identity, Probability::Softmax), "{objective}");
    }
    let error = changed("xgboost-3.2-binary", ["binary:logistic", "reg:other"]).unwrap_err();
    assert_says(error, &["its objective is reg:other"]);
}

#[test]
fn each_objective_of_lightgbm_has_its_link_and_probabilities() {
    let of = |objective: &str| {
        let objective = format!("objective={objective}");
        meaning(&changed("lightgbm-4.7-regression", ["objective=regression", &objective]).unwrap())
    };
    for (names, objects, link) in LIGHTGBM {
        for objective in names.split(' ') {
            assert_eq!(of(objective), (objects, link, Probability::Softmax), "{objective}");
        }
    }
    for objective in WITH_ROOTS.split(' ') {
        assert_eq!(of(objective), (1, Identity, Probability::Softmax), "{objective}");
        assert_eq!(of(&format!("{objective} sqrt")), (1, Square, Probability::Softmax), "{objective}");
    }
    assert_eq!(of("poisson sqrt"), (1, Exponential, Probability::Softmax));
    assert_eq!(of("custom"), (1, Identity, Probability::Unknown));
    let own = "objective=multiclass num_class:3";
    for (objective, probability) in [
        ("multiclass num_class:3", Probability::Softmax),
        ("multiclassova num_class:3 sigmoid:1", Probability::Logistic),
        ("custom", Probability::Unknown),
    ] {
        let of = changed("lightgbm-4.7-multiclass", [own, &format!("objective={objective}")]).unwrap();
        assert_eq!(meaning(&of), (3, Identity, probability), "{objective}");
    }
    let error = changed("lightgbm-4.7-multiclass", [own, "objective=poisson"]).unwrap_err();
    assert_says(error, &["its objective is poisson"]);
}

#[test]
fn each_loss_of_catboost_has_its_link_and_probabilities() {
    let of = |name: &str, words: [&str; 2]| {
        changed(name, words.map(|loss| format!("\"type\":\"{loss}\"")).each_ref().map(String::as_str))
    };
    for (names, objects, link) in CATBOOST {
        for loss in names.split(' ') {
            let ensemble = of("catboost-1.2-regression", ["RMSE", loss]).unwrap();
            assert_eq!(meaning(&ensemble), (objects, link, Probability::Softmax), "{loss}");
        }
    }
    for (loss, probability) in [("MultiClass", Probability::Softmax), ("MultiClassOneVsAll", Probability::Logistic)] {
        let ensemble = of("catboost-1.2-multiclass", ["MultiClass", loss]).unwrap();
        assert_eq!(meaning(&ensemble), (3, Identity, probability), "{loss}");
    }
    for loss in ["MultiRMSE", "MultiRMSEWithMissingValues"] {
        let ensemble = of("catboost-1.2-targets-symmetrictree", ["MultiRMSE", loss]).unwrap();
        assert!(ensemble.prediction().targets && ensemble.objects.len() == 3, "{loss}");
    }
    // Two names make it one of classes.
    let focal = of("catboost-1.2-binary", ["Logloss", "Focal"]).unwrap();
    assert_eq!(meaning(&focal), (2, Identity, Probability::Softmax));
    assert_says(of("catboost-1.2-targets-symmetrictree", ["MultiRMSE", "Other"]).unwrap_err(), &["its loss is Other"]);
}
