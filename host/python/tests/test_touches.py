"""An estimator over touches."""

import numpy as np
import palpate
import pytest

NAMES = ["bowl", "mouse", "fork"]


def touches(seed: int, count: int = 600):
    data = palpate.capture(NAMES, touches=count, seed=seed)
    return data.times, np.array(data.names)[data.objects]


def test_an_estimator_over_touches_finds_objects_and_more_of_them_in_sequences():
    X, y = touches(1)
    recognizer = palpate.TouchRecognizer(rounds=10)
    with pytest.raises(Exception, match="TouchRecognizer is not fitted"):
        recognizer.predict(X)
    assert recognizer.fit(X, y) is recognizer
    assert recognizer.classes_.tolist() == sorted(NAMES)
    unseen, labels = touches(2, 300)
    shares = recognizer.predict_proba(unseen)
    assert shares.shape == (900, 3) and np.allclose(shares.sum(axis=1), 1)
    assert np.array_equal(recognizer.classes_[shares.argmax(axis=1)], recognizer.predict(unseen))
    alone, sequence = recognizer.score(unseen, labels), np.arange(900) // 10
    together = recognizer.score(unseen, labels, sequence=sequence)
    assert 0.5 < alone < together
    assert together > 0.9 and len(recognizer.predict(unseen, sequence=sequence)) == 90
    # The columns are those of the classes, whatever the order of names in the model.
    margins = recognizer.model_.margins(unseen[:5])
    names = recognizer.model_.objects
    assert np.array_equal(recognizer.decision_function(unseen[:5])[:, 0], margins[:, names.index("bowl")])


def test_numbers_name_objects_and_scikit_learn_clones_and_validates_it():
    base = pytest.importorskip("sklearn.base")
    selection = pytest.importorskip("sklearn.model_selection")
    X, y = touches(1, 200)
    numbers = np.unique(y, return_inverse=True)[1] * 5 + 5
    recognizer = palpate.TouchRecognizer(rounds=3, noise="1ms")
    assert base.clone(recognizer).get_params() == recognizer.get_params()
    assert base.is_classifier(recognizer)
    shuffled = selection.StratifiedKFold(3, shuffle=True, random_state=1)
    assert selection.cross_val_score(recognizer, X, numbers, cv=shuffled).mean() > 0.4
    assert set(recognizer.fit(X, numbers).predict(X)) <= {5, 10, 15}
    with pytest.raises(palpate.InputError, match="TouchRecognizer has no depth"):
        recognizer.set_params(depth=3)


def test_figures_of_an_evaluation_are_a_line():
    data = palpate.capture(NAMES, touches=200)
    evaluation = palpate.evaluate(palpate.compile(palpate.train(data, rounds=3)), data, groups=50)
    assert len(repr(evaluation)) < 600
