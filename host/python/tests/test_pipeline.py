"""Pipelines of scalers and trees decide as scikit-learn does, for every f32 number about their thresholds."""

import numpy as np
import palpate
import pytest

sklearn = pytest.importorskip("sklearn")
from sklearn import ensemble, preprocessing, tree  # noqa: E402
from sklearn.decomposition import PCA  # noqa: E402
from sklearn.pipeline import make_pipeline  # noqa: E402

SCALERS = [
    preprocessing.StandardScaler(),
    preprocessing.MinMaxScaler(feature_range=(-0.3, 7.1)),
    preprocessing.MinMaxScaler(clip=True),
    preprocessing.MaxAbsScaler(),
    preprocessing.RobustScaler(quantile_range=(10, 90)),
]
MODELS = [
    ensemble.RandomForestClassifier(n_estimators=5, max_depth=5, random_state=1),
    ensemble.GradientBoostingClassifier(n_estimators=4, random_state=1),
    ensemble.HistGradientBoostingClassifier(max_iter=5),
    tree.DecisionTreeRegressor(max_depth=6),
]


def rows(seed: int, count: int = 400) -> np.ndarray:
    """Columns of very different scales, one of them constant, in f32 numbers."""
    random = np.random.default_rng(seed)
    scaled = random.normal(size=(count, 5)) * [1e-6, 1.0, 3e4, 1e9, 0.0] + [1e-5, -3.0, 1e5, 1.7e9, 42.0]
    return scaled.astype(np.float32).astype(np.float64)


def edges(pipeline: object, about: np.ndarray) -> np.ndarray:
    """Rows with numbers at and next to every place where the model changes, and at the ends of the numbers."""
    features, thresholds, _ = palpate.to_ensemble(pipeline)._splits()
    found = []
    for feature, threshold in zip(features, thresholds):
        near = [np.float32(threshold)]
        for direction in (-np.inf, np.inf):
            near += [np.nextafter(near[0], np.float32(direction))]
        found += [(feature, float(value)) for value in near if np.isfinite(value)]
    found += [(feature, value) for feature in range(5) for value in (0.0, -0.0, 1e-45, -1e-45, 1e30, -1e30)]
    table = about[np.arange(len(found)) % len(about)].copy()
    for row, (feature, value) in zip(table, found):
        row[feature] = value
    return table


@pytest.mark.parametrize("scaler", SCALERS, ids=str)
@pytest.mark.parametrize("model", MODELS, ids=lambda model: type(model).__name__)
def test_a_pipeline_decides_as_scikit_learn_does_next_to_every_threshold(scaler, model):
    X = rows(1)
    y = (X[:, 1] > -3).astype(int) + (X[:, 2] > 1.2e5)
    pipeline = make_pipeline(sklearn.base.clone(scaler), sklearn.base.clone(model)).fit(X, y)
    compiled = palpate.compile(pipeline, leaf="f32")
    tried = np.concatenate([edges(pipeline, X), rows(2)])
    expected = pipeline.predict(tried)
    found = compiled.predict(tried)
    assert np.array_equal(found, expected if hasattr(model, "predict_proba") else expected.astype(np.float32))


def test_two_scalers_and_a_step_that_does_nothing_are_folded_one_after_the_other():
    X = rows(3)
    y = (X[:, 3] > 1.5e9).astype(int)
    steps = preprocessing.StandardScaler(), "passthrough", preprocessing.MinMaxScaler()
    pipeline = make_pipeline(*steps, ensemble.HistGradientBoostingClassifier(max_iter=5)).fit(X, y)
    tried = np.concatenate([edges(pipeline, X), np.full((1, 5), np.nan)])
    assert np.array_equal(palpate.compile(pipeline).predict(tried), pipeline.predict(tried))


SCALER, FOREST = preprocessing.StandardScaler(), ensemble.RandomForestClassifier(n_estimators=5, max_depth=5, random_state=1)
NESTED = {
    "passthrough first": make_pipeline("passthrough", SCALER, FOREST),
    "passthrough alone": make_pipeline("passthrough", FOREST),
    "scalers inside": make_pipeline(make_pipeline("passthrough", SCALER), preprocessing.MinMaxScaler(), FOREST),
    "model inside": make_pipeline(SCALER, make_pipeline(preprocessing.RobustScaler(), "passthrough", FOREST)),
    "model alone": make_pipeline(make_pipeline(FOREST)),
    "tables between": make_pipeline(SCALER, preprocessing.MinMaxScaler(), FOREST).set_output(transform="pandas"),
}


@pytest.mark.parametrize("name", NESTED)
@pytest.mark.parametrize("named", [True, False], ids=["named", "unnamed"])
def test_pipelines_in_pipelines_and_steps_that_do_nothing_keep_names_and_decisions(name, named):
    pandas = pytest.importorskip("pandas")
    columns = ["speed", "", "x" * 300, "temperature / °C", "f0"]
    X, y = rows(5), np.array(["low", "high"])[(rows(5)[:, 1] > -3).astype(int)]
    table = pandas.DataFrame(X, columns=columns) if named else X
    pipeline = sklearn.base.clone(NESTED[name]).fit(table, y)
    model = palpate.compile(pipeline)
    tried = rows(6)
    expected = pipeline.predict(pandas.DataFrame(tried, columns=columns) if named else tried)
    assert np.array_equal(model.predict(tried), expected)
    if named:
        # Names that a model cannot hold are changed, as without a scaler.
        plain = palpate.to_ensemble(sklearn.base.clone(FOREST).fit(table, y))
        assert model.features == plain.features == ["speed", "f1", "x" * 255, "temperature / °C", "f0"]
        assert set(plain.notes) <= set(model.notes)
        shuffled = pandas.DataFrame(tried, columns=model.features).iloc[:, ::-1]
        assert np.array_equal(model.predict(shuffled), expected)


def test_a_pipeline_with_a_step_over_several_columns_is_refused_by_its_name():
    X = rows(4)
    pipeline = make_pipeline(PCA(2), tree.DecisionTreeClassifier()).fit(X, X[:, 1] > -3)
    with pytest.raises(palpate.InputError, match="PCA.*StandardScaler"):
        palpate.compile(pipeline)
