"""Recognize objects by touch.

A simulated probe touches meshes (`capture`), boosted trees learn from the touches (`train`) and are compiled for a
microcontroller (`compile`), whose code also runs here (`Recognizer`, `Model.margins`).

>>> import palpate
>>> data = palpate.capture(["bowl", "mouse"], touches=1000)
>>> train, test = data.split(test_share=0.2)
>>> model = palpate.compile(palpate.train(train))
>>> evaluation = palpate.evaluate(model, test)
>>> evaluation.accuracy[10] > 0.9
True
"""

from importlib.metadata import version as _version

from ._errors import FileError, InputError, ModelWarning, PalpateError, SettingError
from ._evaluate import Evaluation, Parity, Sequential, evaluate, parity
from ._import import compile, to_ensemble
from ._locate import CalibratedMaps, MapsEvaluation
from ._native import DataSet, Ensemble, Locator, Maps, Model, Recognizer, Shape, Surface, capture, train
from ._stream import (
    Calibrated,
    Ends,
    Estimated,
    SequenceRecognizer,
    calibrate,
    evaluate_sequences,
)
from ._touches import TouchRecognizer
from ._types import Located, Meshes, Mode, Probe, Progress, Real, Touch, Verdict

__version__ = _version("palpate")

__all__ = [
    "Calibrated",
    "CalibratedMaps",
    "DataSet",
    "Ends",
    "Ensemble",
    "Estimated",
    "Evaluation",
    "FileError",
    "InputError",
    "Located",
    "Locator",
    "Maps",
    "MapsEvaluation",
    "Meshes",
    "Mode",
    "Model",
    "ModelWarning",
    "PalpateError",
    "Parity",
    "Probe",
    "Progress",
    "Real",
    "Recognizer",
    "SequenceRecognizer",
    "Sequential",
    "SettingError",
    "Shape",
    "Surface",
    "Touch",
    "TouchRecognizer",
    "Verdict",
    "calibrate",
    "capture",
    "compile",
    "evaluate",
    "evaluate_sequences",
    "parity",
    "to_ensemble",
    "train",
]
