"""Makes the files of this directory: small models of other libraries, rows, and the libraries' own margins.

    python3.11 -m venv xgboost-2.1 && xgboost-2.1/bin/pip install xgboost==2.1.4 numpy scipy
    xgboost-2.1/bin/python make.py xgboost

and the same with XGBoost 1.6.2, 1.7.6, 3.0.5, 3.2.0 and (Python 3.12) 3.4.0, then, each with the packages that it imports,
`make.py lightgbm`, `make.py catboost`, `make.py onnx` (scikit-learn, skl2onnx, onnx, onnxruntime) and `make.py onnxmltools`
(onnxmltools, xgboost, lightgbm). `make.py predictions`, with all of these packages, opens the models whose tables have no
predictions yet with the installed library, and asks it. Objectives that differ by their name alone have one model: what each
predicts is in `host/trees/tests/trees/objectives.rs`. Beside every model is its table, NAME.csv, with 20 rows like the
training's, 20 with values that equal thresholds of the model, the numbers beside them or zero, and 20 with missing values
(empty). Its columns:

features     by name, or f0 and so on where the model's file has no names
margin       the library's raw scores: one column per output (margin0 and so on), one for a binary model. f32 scores have as
             many digits as distinguish them, f64 scores seventeen
prediction   the library's `predict`: a class by name or number, of boosters that with the largest probability; or the value, a
             column for each of several targets
probability  of some: the probability of each class
"""

import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
NAMES = ["width", "height", "count", "angle"]
UNNAMED = ["f0", "f1", "f2", "f3"]
ROWS = 20


def data(classes, seed=7, rows=400):
    """Rows of four features: two real, one a small whole number with many zeros, one with a tenth missing."""
    random = np.random.default_rng(seed)
    label = random.integers(0, classes, rows)
    x = np.empty((rows, 4), np.float32)
    x[:, 0] = random.normal(0.4 * label, 1.0)
    x[:, 1] = random.normal(1000.0 - 30.0 * label, 40.0)
    x[:, 2] = np.maximum(random.poisson(1.0 + label) - 1, 0)
    x[:, 3] = random.uniform(-3.0, 3.0, rows) + 0.3 * (label == 1)
    return x, label


def with_missing(x, seed=3):
    x = x.copy()
    x[np.random.default_rng(seed).uniform(size=len(x)) < 0.1, 3] = np.nan
    return x


KIND = 2  # The feature that `kinds` makes a category.
STRANGE = [np.nan, -1.0, -0.5, -0.0, 0.5, 2.9999, 7.5, 19.0, 20.0, 63.0, 64.0, 5000.0, 16777215.0, 16777216.0, 1e9, -1e9]
"""Categories that are missing, negative, fractions, not in training, or beyond what f32 or a library counts to."""


def kinds(x, number=20):
    """Rows with a category whose neighbors have nothing in common, the label's share among others."""
    x = x.copy()
    of_row = np.floor(np.abs(x[:, 0] * 37.7)) % number
    x[:, KIND] = (of_row * 7 + 3) % number
    return x


def kind_rows(thresholds, number=20, strange=STRANGE):
    """Rows as of `rows`, and one of each category and of each strange value; other features are plain."""
    test = rows(thresholds, True)
    test[:, KIND] = np.random.default_rng(6).integers(0, number + 2, len(test))
    more = data(3, seed=15, rows=number + len(strange))[0]
    more[:, KIND] = np.concatenate([np.arange(number), strange])
    return np.vstack([test, more]).astype(np.float32)


def rows(thresholds, missing, classes=3):
    """Plain, tied and missing rows; `thresholds` is a list for each feature."""
    random = np.random.default_rng(11)
    plain = data(classes, seed=12, rows=ROWS)[0]
    tied = data(classes, seed=13, rows=ROWS)[0]
    for row in tied:
        for feature, own in enumerate(thresholds):
            if len(own) and random.uniform() < 0.8:
                at = np.float32(own[random.integers(len(own))])
                near = [at, np.nextafter(at, np.float32(-np.inf)), np.nextafter(at, np.float32(np.inf)), np.float32(0)]
                row[feature] = near[random.integers(4)]
    if not missing:
        return np.vstack([plain, tied])
    gone = data(classes, seed=14, rows=ROWS)[0]
    gone[random.uniform(size=gone.shape) < 0.4] = np.nan
    gone[-1] = np.nan
    return np.vstack([plain, tied, gone])


def text(value):
    if np.isnan(value):
        return ""
    return repr(float(value)) if isinstance(value, np.float64) else str(value)


def columns(kind, values):
    """Lines of cells; the first line names the columns."""
    values = np.asarray(values)
    values = values.reshape(len(values), -1)
    plain = lambda value: str(value) if isinstance(value, (str, np.integer)) else text(value)
    head = [kind] if values.shape[1] == 1 else [f"{kind}{index}" for index in range(values.shape[1])]
    return [head] + [[plain(value) for value in row] for row in values]


def write(name, x, margins, names=NAMES, predictions=None, probabilities=None):
    kinds = {"margin": margins, "prediction": predictions, "probability": probabilities}
    parts = [columns(kind, values) for kind, values in kinds.items() if values is not None]
    parts.insert(0, [names] + columns("", x)[1:])
    lines = [",".join(sum(cells, [])) for cells in zip(*parts)]
    (HERE / f"{name}.csv").write_text("\n".join(lines) + "\n")
    print(name, np.asarray(margins).dtype, np.asarray(margins).shape)


def most_likely(probabilities):
    """The class of each row by a booster's probabilities: of two classes it has that of the second one."""
    probabilities = np.asarray(probabilities)
    return probabilities.argmax(axis=1) if probabilities.ndim == 2 else (probabilities > 0.5).astype(int)


def xgboost_thresholds(booster):
    frame = {index: [] for index in range(4)}
    for dump in booster.get_dump():
        for line in dump.splitlines():
            if "[" in line:
                feature, threshold = line.split("[")[1].split("]")[0].split("<")
                frame[NAMES.index(feature)].append(float(threshold))
    return [frame[index] for index in range(4)]


def make_xgboost():
    import json

    import xgboost as xgb

    version = ".".join(xgb.__version__.split(".")[:2])
    release = tuple(int(part) for part in version.split("."))
    plain = {"max_depth": 2, "eta": 0.4, "tree_method": "hist", "max_bin": 16, "seed": 1, "nthread": 1}

    def save(kind, extension, classes, settings, rounds=3, missing=True, label=None, predict=False):
        x, y = data(max(classes, 2))
        x = with_missing(x) if missing else x
        y = y if label is None else label(x, y)
        train = xgb.DMatrix(x, y, feature_names=NAMES)
        booster = xgb.train({**plain, **settings}, train, rounds)
        name = f"xgboost-{version}-{kind}"
        booster.save_model(HERE / f"{name}.{extension}")
        thresholds = xgboost_thresholds(booster) if settings.get("multi_strategy") is None else json_thresholds(booster)
        test = rows(thresholds, True, max(classes, 2))
        margins = booster.predict(xgb.DMatrix(test, feature_names=NAMES), output_margin=True)
        predictions = xgboost_predictions(booster, test) if predict else None
        write(name, test, margins, predictions=predictions)

    def json_thresholds(booster):
        model = json.loads(booster.save_raw("json"))["learner"]["gradient_booster"]["model"]
        thresholds = [[] for _ in range(4)]
        for tree in model["trees"]:
            for left, feature, at in zip(tree["left_children"], tree["split_indices"], tree["split_conditions"]):
                if left != -1:
                    thresholds[feature].append(at)
        return thresholds

    def save_kinds(kind, settings, classes=2):
        x, y = data(classes)
        x = kinds(with_missing(x))
        x[np.random.default_rng(8).uniform(size=len(x)) < 0.1, KIND] = np.nan
        y = (y + (x[:, KIND] % 3 == 1)) % classes
        types = ["c" if index == KIND else "q" for index in range(4)]
        matrix = lambda x, y=None: xgb.DMatrix(x, y, feature_names=NAMES, feature_types=types, enable_categorical=True)
        booster = xgb.train({**plain, **settings}, matrix(x, y), 3)
        name = f"xgboost-{version}-{kind}"
        booster.save_model(HERE / f"{name}.json")
        test = kind_rows(json_thresholds(booster))
        write(name, test, booster.predict(matrix(test), output_margin=True))

    def save_targets(kind, settings):
        x, y = data(3)
        targets = np.stack([amount(x, y), x[:, 1] / 100, x[:, 3] * x[:, 0]], axis=1)
        booster = xgb.train({**plain, "objective": "reg:squarederror", **settings}, xgb.DMatrix(with_missing(x), targets, feature_names=NAMES), 3)
        name = f"xgboost-{version}-{kind}"
        booster.save_model(HERE / f"{name}.json")
        test = rows(json_thresholds(booster), True)
        predicted = booster.predict(xgb.DMatrix(test, feature_names=NAMES), output_margin=True)
        write(name, test, predicted)

    binary = {"objective": "binary:logistic", "base_score": 0.3}
    softprob = {"objective": "multi:softprob", "num_class": 3}
    amount = lambda x, y: np.abs(x[:, 0]) * 3 + y
    dart = {"booster": "dart", "rate_drop": 0.5, "one_drop": 1, "skip_drop": 0.0}
    if release not in [(1, 7), (2, 1)]:
        save("binary", "json", 2, binary)
    if release in [(1, 6), (2, 1), (3, 4)]:
        save("softprob", "ubj", 3, softprob, rounds=2)
    if release in [(1, 6), (3, 2), (3, 4)]:
        save("dart", "json", 3, {**softprob, **dart}, rounds=2)
    if release == (3, 4):
        save("softmax", "json", 3, {**softprob, "objective": "multi:softmax", "base_score": 0.25}, rounds=2)
    if release == (1, 6):
        save("logitraw", "ubj", 2, {**binary, "objective": "binary:logitraw"})
    if release == (3, 2):
        # Not in the file: the estimator's missing value, and that it predicts with the trees up to the best round.
        x, y = data(2, rows=800)
        x[np.random.default_rng(5).uniform(size=x.shape) < 0.3] = 0
        small = {"n_estimators": 3, "max_depth": 2, "random_state": 1}
        keep = xgb.XGBClassifier(**small, missing=0.0).fit(x, y)
        keep.get_booster().feature_names = NAMES
        estimators = {"missing-0": (keep, rows(xgboost_thresholds(keep.get_booster()), False, 2))}
        late = {**small, "n_estimators": 40, "learning_rate": 1.0, "early_stopping_rounds": 2}
        stopped = xgb.XGBClassifier(**late).fit(x[:400], y[:400], eval_set=[(x[400:], y[400:])], verbose=False)
        estimators["early-stopping"] = (stopped, rows([[]] * 4, False, 2))
        for kind, (model, test) in estimators.items():
            name = f"xgboost-{version}-{kind}"
            model.save_model(HERE / f"{name}.json")
            names = model.get_booster().feature_names or UNNAMED
            write(name, test, model.predict(test, output_margin=True), names, predictions=model.predict(test))
        save("count-poisson", "json", 0, {"objective": "count:poisson"}, label=amount, predict=True)
        save("reg-logistic", "json", 0, {"objective": "reg:logistic"}, label=lambda x, y: y * 0.8 + 0.1, predict=True)
        for objective in ["squarederror", "gamma"]:
            save(f"reg-{objective}", "json", 0, {"objective": f"reg:{objective}"}, rounds=2, label=amount, predict=True)
        save("hinge", "json", 2, {"objective": "binary:hinge"}, rounds=2, predict=True)
        save("one-class", "json", 2, {"objective": "binary:logistic"}, rounds=2, label=lambda x, y: 0 * y, predict=True)
    if release == (2, 1):
        save("dart-binary", "ubj", 2, {**binary, **dart}, rounds=5)
        save("forest", "json", 2, {**binary, "num_parallel_tree": 3, "subsample": 0.7, "eta": 1}, rounds=2)
        save("squarederror", "ubj", 0, {"objective": "reg:squarederror"}, label=amount)
    if release in [(2, 1), (3, 2)]:
        save("vector-leaves", "json", 3, {**softprob, "multi_strategy": "multi_output_tree"})
    if release in [(1, 7), (2, 1), (3, 2)]:
        # By sets of categories, and one category at a time.
        by_set = {"max_cat_to_onehot": 2, "max_depth": 3}
        save_kinds("categorical", {**binary, **by_set})
        if release == (3, 2):
            save_kinds("one-hot", {**binary, **by_set, "max_cat_to_onehot": 100})
    if release == (3, 2):
        save_targets("targets", {})
    if release in [(2, 1), (3, 2)]:
        save_targets("targets-vector", {"multi_strategy": "multi_output_tree"})
    if release == (3, 2):
        # A vector of intercepts, fitted to the labels.
        save("intercepts", "ubj", 3, softprob, label=lambda x, y: np.where(y == 2, 0, y), rounds=2)


def xgboost_predictions(booster, x):
    import json

    import xgboost as xgb

    objective = json.loads(booster.save_config())["learner"]["objective"]["name"]
    predicted = booster.predict(xgb.DMatrix(x, feature_names=NAMES, feature_types=booster.feature_types))
    if objective in ("binary:logistic", "multi:softprob"):
        return most_likely(predicted)
    if objective == "binary:logitraw":
        return (predicted > 0).astype(int)
    return predicted.astype(int) if objective in ("binary:hinge", "multi:softmax") else predicted


def make_lightgbm():
    import lightgbm as lgb

    plain = {"num_leaves": 4, "learning_rate": 0.4, "max_bin": 15, "verbose": -1, "seed": 1, "num_threads": 1,
             "min_data_in_leaf": 5, "deterministic": True}

    def save(kind, classes, settings, rounds=3, missing=False, label=None, change=lambda x: x, predict=False,
             test=None):
        x, y = data(max(classes, 2))
        x = change(with_missing(x) if missing else x)
        y = y if label is None else label(x, y)
        booster = lgb.train({**plain, **settings}, lgb.Dataset(x, y, feature_name=NAMES), rounds)
        name = f"lightgbm-{lgb.__version__.rsplit('.', 1)[0]}-{kind}"
        # The same without the parameters of the training (half of the file).
        booster.save_model(HERE / f"{name}.txt")
        path = HERE / f"{name}.txt"
        path.write_text(path.read_text().split("\nparameters:")[0] + "\n")
        frame = booster.trees_to_dataframe()
        thresholds = [[] for _ in range(4)]
        for feature, threshold in zip(frame["split_feature"], frame["threshold"]):
            if isinstance(feature, str) and isinstance(threshold, (int, float)):
                at = np.float32(threshold)
                thresholds[NAMES.index(feature)].append(at)
        test = rows(thresholds, True, max(classes, 2)) if test is None else test
        shares = predictions = booster.predict(test) if predict else None
        predictions = most_likely(shares) if classes and predict else predictions
        write(name, test, booster.predict(test, raw_score=True), predictions=predictions,
              probabilities=shares if classes else None)

    amount = lambda x, y: np.abs(x[:, 0]) * 3 + y
    often_missing = lambda x: np.where(np.random.default_rng(9).uniform(size=x.shape) < 0.3, np.nan, x)
    # Missing values carry most of the information: splits of them against all others, whose threshold is infinite.
    save("missing-alone", 2, {"objective": "binary", "num_leaves": 6}, change=often_missing,
         label=lambda x, y: np.isnan(x[:, 0]) ^ (np.isnan(x[:, 3]) & (y == 1)))
    for objective in ["poisson", "cross_entropy", "cross_entropy_lambda"]:
        share = "entropy" in objective
        save(objective, 0, {"objective": objective}, predict=True,
             label=(lambda x, y: y * 0.8 + 0.1) if share else (lambda x, y: amount(x, y) + 0.1))
    save("sqrt", 0, {"objective": "regression", "reg_sqrt": True}, label=lambda x, y: amount(x, y) - 4, predict=True)
    save("multiclassova", 3, {"objective": "multiclassova", "num_class": 3}, predict=True)
    save("sigmoid", 2, {"objective": "binary", "sigmoid": 2.5}, predict=True)
    # Predictions of a forest are those of its trees' mean.
    forest = {"boosting": "rf", "bagging_fraction": 0.6, "bagging_freq": 1}
    save("forest-regression", 0, {"objective": "regression", **forest}, rounds=5, label=amount, predict=True)
    save("forest-gamma", 0, {"objective": "gamma", **forest}, rounds=5, label=lambda x, y: amount(x, y) + 0.1, predict=True)
    save("forest-multiclass", 3, {"objective": "multiclass", "num_class": 3, **forest}, rounds=5, predict=True)
    save("large-target", 0, {"objective": "regression"}, label=lambda x, y: 1e6 * amount(x, y), predict=True)
    save("small-target", 0, {"objective": "regression"}, label=lambda x, y: 1e-6 * amount(x, y), predict=True)
    # Seconds since 1970: f32 holds every 128th.
    seconds = lambda x: np.column_stack([x[:, 0], np.round(1.7e9 + x[:, 1].astype(float)), x[:, 2], x[:, 3]])
    save("seconds", 2, {"objective": "binary", "max_bin": 60, "num_leaves": 8}, rounds=4, change=seconds,
         test=seconds(data(2, seed=21, rows=60)[0]))
    save("zeros-missing-deep", 2, {"objective": "binary", "zero_as_missing": True, "num_leaves": 31, "min_data_in_leaf": 2},
         change=lambda x: np.where(np.random.default_rng(9).uniform(size=x.shape) < 0.3, 0, x), rounds=3)

    save("binary", 2, {"objective": "binary"}, missing=True)
    save("multiclass", 3, {"objective": "multiclass", "num_class": 3})
    save("zero-as-missing", 2, {"objective": "binary", "zero_as_missing": True}, rounds=6)
    save("forest", 2, {"objective": "binary", "boosting": "rf", "bagging_fraction": 0.6, "bagging_freq": 1}, missing=True,
         predict=True)
    save("regression", 0, {"objective": "regression"}, label=lambda x, y: np.abs(x[:, 0]) * 3 + y)

    def save_kinds(kind, settings, number=20):
        x, y = data(2)
        x = kinds(with_missing(x), number)
        x[np.random.default_rng(8).uniform(size=len(x)) < 0.1, KIND] = np.nan
        y = (y + (x[:, KIND] % 3 == 1)) % 2
        settings = {**plain, "objective": "binary", "num_leaves": 6, "min_data_per_group": 5, "cat_smooth": 1, **settings}
        own = lgb.Dataset(x, y, feature_name=NAMES, categorical_feature=[KIND])
        booster = lgb.train(settings, own, 3)
        name = f"lightgbm-{lgb.__version__.rsplit('.', 1)[0]}-{kind}"
        path = HERE / f"{name}.txt"
        booster.save_model(path)
        path.write_text(path.read_text().split("\nparameters:")[0] + "\n")
        test = kind_rows([[]] * 4, number)
        write(name, test, booster.predict(test, raw_score=True))

    save_kinds("categorical", {"max_cat_to_onehot": 1})
    save_kinds("categorical-many", {"max_cat_to_onehot": 1}, number=70)
    save_kinds("one-hot", {"max_cat_to_onehot": 100})
    save_kinds("categorical-zero-as-missing", {"max_cat_to_onehot": 1, "zero_as_missing": True})
    save("linear", 0, {"objective": "regression", "linear_tree": True}, rounds=2,
         label=lambda x, y: np.abs(x[:, 0]) * 3 + y)


def make_catboost():
    import json

    import catboost

    version = ".".join(catboost.__version__.split(".")[:2])

    def save(kind, model, classes, settings, missing=True, label=None):
        x, y = data(max(classes, 2))
        x = with_missing(x) if missing else x
        y = y if label is None else label(x, y)
        settings = {"iterations": 3, "depth": 2, "learning_rate": 0.4, "border_count": 12, "random_seed": 1,
                    "thread_count": 1, "verbose": False, "allow_writing_files": False, **settings}
        booster = model(**settings)
        booster.fit(catboost.Pool(x, y, feature_names=NAMES))
        name = f"catboost-{version}-{kind}"
        shorten(booster, name)
        borders = booster.get_borders()
        test = rows([borders[index] for index in range(4)], missing, max(classes, 2))
        write(name, test, booster.predict(test, prediction_type="RawFormulaVal"), predictions=booster.predict(test))

    def save_kinds(kind, settings, strings=False, alone=False):
        x, y = data(2)
        x = kinds(with_missing(x), 12)
        # Alone the category decides, so that it is split on however it is counted.
        y = ((0 if alone else y) + (x[:, KIND] % 3 == 1)) % 2
        # CatBoost's categories are whole numbers.
        known = [number for number in STRANGE if number == int(0 if np.isnan(number) else number) and abs(number) < 2**24]
        test = kind_rows([[]] * 4, 12, known)
        word = lambda number: f"k{number:.0f}" if strings else int(number)
        mixed = lambda x: np.array([[word(row[KIND]) if at == KIND else row[at] for at in range(4)] for row in x], object)
        settings = {"iterations": 3, "depth": 3, "learning_rate": 0.4, "border_count": 12, "random_seed": 1,
                    "thread_count": 1, "verbose": False, "allow_writing_files": False, **settings}
        booster = catboost.CatBoostClassifier(**settings)
        booster.fit(catboost.Pool(mixed(x), y, feature_names=NAMES, cat_features=[KIND]))
        name = f"catboost-{version}-{kind}"
        shorten(booster, name)
        write(name, test, booster.predict(catboost.Pool(mixed(test), feature_names=NAMES, cat_features=[KIND]),
                                          prediction_type="RawFormulaVal"))

    def shorten(booster, name):
        """Saves a model without what is known about the training (5 of 8 KB), and without indentation."""
        path = HERE / f"{name}.json"
        booster.save_model(str(path), format="json")
        document = json.loads(path.read_text())
        about = document["model_info"]
        about["params"] = {"loss_function": about["params"]["loss_function"]}
        about.pop("output_options", None)
        about.pop("training", None)
        path.write_text(json.dumps(document, separators=(",", ":")) + "\n")

    save_kinds("one-hot", {"one_hot_max_size": 20})
    save_kinds("one-hot-lossguide", {"one_hot_max_size": 20, "grow_policy": "Lossguide", "max_leaves": 6})
    save_kinds("one-hot-words", {"one_hot_max_size": 20}, strings=True)
    save_kinds("statistics", {"one_hot_max_size": 2}, alone=True)
    x, y = data(3)
    targets = np.stack([np.abs(x[:, 0]) * 3 + y, x[:, 1] / 100, x[:, 3] * x[:, 0]], axis=1)
    for policy in ["SymmetricTree", "Depthwise"]:
        booster = catboost.CatBoostRegressor(
            loss_function="MultiRMSE", iterations=3, depth=2, learning_rate=0.4, border_count=12, random_seed=1,
            thread_count=1, verbose=False, allow_writing_files=False, grow_policy=policy)
        booster.fit(catboost.Pool(with_missing(x), targets, feature_names=NAMES))
        name = f"catboost-{version}-targets-{policy.lower()}"
        shorten(booster, name)
        borders = booster.get_borders()
        test = rows([borders[index] for index in range(4)], True)
        write(name, test, booster.predict(test, prediction_type="RawFormulaVal"))

    amount = lambda x, y: np.abs(x[:, 0]) * 3 + y
    words = np.array(["cup", "jug", "pan"])
    save("binary", catboost.CatBoostClassifier, 2, {})
    save("multiclass", catboost.CatBoostClassifier, 3, {}, label=lambda x, y: words[y])
    save("max-missing", catboost.CatBoostClassifier, 2, {"nan_mode": "Max"})
    save("lossguide", catboost.CatBoostClassifier, 3, {"grow_policy": "Lossguide", "max_leaves": 5, "depth": 4})
    save("depthwise", catboost.CatBoostClassifier, 2, {"grow_policy": "Depthwise"})
    save("regression", catboost.CatBoostRegressor, 0, {}, label=amount)
    positive = lambda x, y: amount(x, y) + 0.1
    save("tweedie", catboost.CatBoostRegressor, 0, {"loss_function": "Tweedie:variance_power=1.5"}, label=positive)
    save("onevsall", catboost.CatBoostClassifier, 3, {"loss_function": "MultiClassOneVsAll"})
    save("crossentropy", catboost.CatBoostClassifier, 2, {"loss_function": "CrossEntropy"})


def onnx_raw(model):
    """Model without its last transformation: its output are raw scores."""
    import copy

    import onnx

    raw = copy.deepcopy(model)
    for node in raw.graph.node:
        for attribute in node.attribute:
            if attribute.name == "post_transform" and node.op_type != "TreeEnsemble":
                attribute.s = b"NONE"
    # Only the ensemble: what is behind it needs other shapes.
    for node in raw.graph.node:
        if node.op_type.startswith("TreeEnsemble"):
            del raw.graph.output[:]
            raw.graph.output.append(onnx.helper.make_tensor_value_info(node.output[-1], onnx.TensorProto.FLOAT, None))
    return raw


def save_onnx(name, model, classes, pick=lambda scores: scores, missing=True):
    import onnx
    import onnxruntime

    thresholds = [[] for _ in range(4)]
    for node in model.graph.node:
        found = {a.name: onnx.helper.get_attribute_value(a) for a in node.attribute}
        if "nodes_modes" not in found:
            continue
        values = found.get("nodes_values")
        for key in ("nodes_values_as_tensor", "nodes_splits"):
            if key in found:
                values = onnx.numpy_helper.to_array(found[key])
        modes = found["nodes_modes"]
        leaves = [mode == b"LEAF" for mode in modes] if isinstance(modes, list) else [False] * len(values)
        for feature, value, leaf in zip(found["nodes_featureids"], values, leaves):
            if not leaf:
                thresholds[feature].append(np.float32(value))
    (HERE / f"{name}.onnx").write_bytes(model.SerializeToString())
    test = rows(thresholds, missing, max(classes, 2))
    session = onnxruntime.InferenceSession(onnx_raw(model).SerializeToString())
    kind = session.get_inputs()[0].type
    given = test.astype(np.float64 if "double" in kind else np.float32)
    (scores,) = session.run(None, {session.get_inputs()[0].name: given})
    write(name, test, pick(scores), UNNAMED)


def make_onnx():
    import onnx
    import sklearn
    from onnx import helper
    from skl2onnx import to_onnx
    from sklearn import ensemble

    version = ".".join(sklearn.__version__.split(".")[:2])
    second = lambda scores: scores[:, 1]

    def convert(kind, model, classes, pick=lambda scores: scores, label=None, **options):
        x, y = data(max(classes, 2))
        y = y if label is None else label(x, y)
        model.fit(x, y)
        save_onnx(f"sklearn-{version}-{kind}", to_onnx(model, x[:1], **options), classes, pick)

    amount = lambda x, y: np.abs(x[:, 0]) * 3 + y
    words = np.array(["cup", "jug", "pan"])
    few = {"n_estimators": 3, "max_depth": 2, "random_state": 1}
    # Ten trees that vote: five to five is a tie, which goes to the first class.
    for kind, size in [("ties", 10), ("ties-three", 6)]:
        x, y = data(3 if kind == "ties-three" else 2, rows=60)
        x = np.round(x).astype(np.float32)
        model = ensemble.RandomForestClassifier(n_estimators=size, random_state=1).fit(x, y)
        test = np.round(data(3, seed=21, rows=300)[0]).astype(np.float32)
        name = f"sklearn-{version}-{kind}"
        (HERE / f"{name}.onnx").write_bytes(to_onnx(model, x[:1]).SerializeToString())
        shares = model.predict_proba(test)
        write(name, test, shares if shares.shape[1] > 2 else shares[:, 1], UNNAMED, predictions=model.predict(test))
    convert("forest", ensemble.RandomForestClassifier(**few), 3, label=lambda x, y: words[y])
    convert("forest-binary", ensemble.RandomForestClassifier(**few), 2, second)
    convert("forest-regression", ensemble.RandomForestRegressor(**few), 0, label=amount)
    convert("boosting", ensemble.GradientBoostingClassifier(**few), 3)
    convert("boosting-binary", ensemble.GradientBoostingClassifier(**few), 2, second)
    convert("boosting-regression", ensemble.GradientBoostingRegressor(**few), 0, label=amount)
    convert("extra-trees-opset1", ensemble.ExtraTreesClassifier(**few), 3, target_opset={"": 12, "ai.onnx.ml": 1})

    # No exporter writes this yet: two trees over two targets, every comparison, missing values both ways.
    f32 = lambda name, values: helper.make_tensor(name, onnx.TensorProto.FLOAT, [len(values)], values)
    u8 = lambda name, values: helper.make_tensor(name, onnx.TensorProto.UINT8, [len(values)], values)
    node = helper.make_node(
        "TreeEnsemble", ["X"], ["Y"], domain="ai.onnx.ml", n_targets=2, aggregate_function=1, post_transform=0,
        tree_roots=[0, 3],
        nodes_featureids=[0, 1, 2, 3, 0],
        nodes_splits=f32("nodes_splits", [0.25, 990.5, 1.0, -0.5, 1.5]),
        nodes_modes=u8("nodes_modes", [0, 1, 2, 3, 0]),
        nodes_truenodeids=[1, 0, 2, 4, 5],
        nodes_trueleafs=[0, 1, 1, 0, 1],
        nodes_falsenodeids=[2, 1, 3, 4, 6],
        nodes_falseleafs=[0, 1, 1, 1, 1],
        nodes_missing_value_tracks_true=[1, 0, 1, 0, 0],
        leaf_targetids=[0, 1, 0, 1, 1, 1, 1],
        leaf_weights=f32("leaf_weights", [0.5, -0.25, 1.5, 0.75, -1.25, 2.5, -0.125]),
    )
    opset = [helper.make_opsetid("", 20), helper.make_opsetid("ai.onnx.ml", 5)]
    graph = helper.make_graph(
        [node], "by hand",
        [helper.make_tensor_value_info("X", onnx.TensorProto.FLOAT, [None, 4])],
        [helper.make_tensor_value_info("Y", onnx.TensorProto.FLOAT, [None, 2])],
    )
    save_onnx("onnx-opset5", helper.make_model(graph, opset_imports=opset, ir_version=10), 2)


def make_onnxmltools():
    import lightgbm
    import onnxmltools
    import xgboost
    from onnxmltools.convert.common.data_types import FloatTensorType

    shape = [("X", FloatTensorType([None, 4]))]
    second = lambda scores: scores[:, 1] if scores.shape[1] == 2 else scores[:, 0]
    x, y = data(2)
    booster = xgboost.XGBClassifier(n_estimators=3, max_depth=2, base_score=0.5).fit(x, y)
    save_onnx("onnxmltools-xgboost-binary", onnxmltools.convert_xgboost(booster, initial_types=shape), 2, second)
    x, y = data(3)
    booster = xgboost.XGBClassifier(n_estimators=2, max_depth=2).fit(x, y)
    save_onnx("onnxmltools-xgboost-softprob", onnxmltools.convert_xgboost(booster, initial_types=shape), 3)
    booster = lightgbm.LGBMClassifier(n_estimators=2, num_leaves=4, verbose=-1).fit(x, y)
    save_onnx("onnxmltools-lightgbm-multiclass", onnxmltools.convert_lightgbm(booster, initial_types=shape), 3)


def make_predictions():
    """Predictions of the libraries with the models that have no predictions yet, categories as the library takes them.
    XGBoost is not asked about files of later versions, whose dart it misreads, nor about leaves with several values of
    earlier ones, which it opens and does not survive."""
    import xgboost

    number = lambda version: tuple(int(part) for part in version.split(".")[:2])
    version = number(xgboost.__version__)

    for path in sorted(HERE.iterdir()):
        name = path.name.rsplit(".", 1)[0]
        table = HERE / f"{name}.csv"
        if path.suffix not in (".json", ".ubj", ".txt", ".onnx") or "prediction" in table.read_text():
            continue
        lines = table.read_text().splitlines()
        x = np.array([[float(cell or "nan") for cell in line.split(",")[:4]] for line in lines[1:]], np.float32)
        if name.startswith("xgboost"):
            own, several = number(name.split("-")[1]), "-targets" in name or "-vector-leaves" in name
            if own > version or (several and own != version):
                continue
            try:
                booster = xgboost.Booster(model_file=path)
                predictions = xgboost_predictions(booster, x)
            except xgboost.core.XGBoostError as error:
                print(name, "not by this version:", str(error).splitlines()[0][:100])
                continue
        elif name.startswith("lightgbm"):
            import lightgbm

            booster = lightgbm.Booster(model_file=str(path))
            is_class = any(line.startswith(("objective=binary", "objective=multiclass")) for line in path.read_text().splitlines())
            predictions = booster.predict(x)
            predictions = most_likely(predictions) if is_class else predictions
        elif name.startswith("catboost"):
            if "-one-hot-words" in name or "-statistics" in name:
                continue
            import catboost

            is_class = "class_params" in path.read_text()
            model = (catboost.CatBoostClassifier if is_class else catboost.CatBoostRegressor)().load_model(str(path), format="json")
            if "-one-hot" in name:
                x = np.array([[int(cell) if at == KIND else cell for at, cell in enumerate(row)] for row in x], object)
                x = catboost.Pool(x, feature_names=NAMES, cat_features=[KIND])
            predictions = model.predict(x)
        else:
            import onnxruntime

            session = onnxruntime.InferenceSession(str(path))
            kind = session.get_inputs()[0].type
            given = x.astype(np.float64 if "double" in kind else np.float32)
            predictions = session.run(None, {session.get_inputs()[0].name: given})[0]
            # It does not say that its outputs are classes, but is taken for such.
            predictions = predictions.argmax(axis=1) if name == "onnx-opset5" else predictions
        lines = [",".join([line, *cells]) for line, cells in zip(lines, columns("prediction", predictions))]
        table.write_text("\n".join(lines) + "\n")
        print(name)


if __name__ == "__main__":
    globals()[f"make_{sys.argv[1]}"]()
