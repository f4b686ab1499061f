"""
The part of the package palpate that is written in Rust.
"""

from _typeshed import SupportsGetItem
from numpy import float32, float64, int16, int64
from numpy.typing import ArrayLike, NDArray
from os import PathLike
from palpate._locate import CalibratedMaps, MapsEvaluation
from palpate._types import Located, Meshes, Predictions, Probe, Progress, Real, Touch, Verdict
from pandas import DataFrame
from pathlib import Path
from typing import Any, SupportsFloat, SupportsIndex, final

__all__ = ["DataSet", "Ensemble", "Locator", "Maps", "Model", "Recognizer", "Shape", "Surface", "calibrate", "capture", "checksums", "compile", "estimate_sequences", "evaluate", "evaluate_sequences", "parity", "sources", "train"]

@final
class DataSet:
    """
    Touches of one or more objects.

    Its arrays have one row per touch, the objects one after the other. They are made when they are first asked for, belong
    to the data set, and cannot be written to: every access gives the same memory.

    >>> import numpy, palpate
    >>> data = palpate.DataSet.from_arrays(
    ...     times=[[0.0, 0.012, 0.031], [0.004, 0.0, numpy.nan], [0.0, 0.2, 0.1]],
    ...     objects=[0, 0, 1],
    ...     names=["cup", "fork"],
    ... )
    >>> len(data), data.names, data.counts
    (3, ['cup', 'fork'], [2, 1])
    >>> data.times
    array([[0.   , 0.012, 0.031],
           [0.004, 0.   ,   nan],
           [0.   , 0.2  , 0.1  ]])
    """
    def __len__(self, /) -> int: ...
    def __repr__(self, /) -> str: ...
    @property
    def alignment(self, /) -> NDArray[float32] | None:
        """
        The direction of the row of fingers at each touch, a unit vector; `None` if no touch has a pose.
        """
    @property
    def approaches(self, /) -> list[int] | None:
        """
        The number of approaches to each object, if known.
        """
    @property
    def counts(self, /) -> list[int]:
        """
        The number of touches of each object, in the order of the names.
        """
    @property
    def direction(self, /) -> NDArray[float32] | None:
        """
        The probe's direction at each touch, a unit vector; `None` if no touch has a pose.
        """
    def features(self, /, descriptor: str = "curvature") -> NDArray[float32]:
        """
        The features of each touch under a descriptor, one row of whole numbers per touch (microseconds, and direction cosines times
        32767), NaN where one is missing: for training with another library. The code is the chip's.
        """
    @staticmethod
    def from_arrays(times: ArrayLike, objects: ArrayLike, names: SupportsGetItem[int, str], *, direction: ArrayLike | None = None, alignment: ArrayLike | None = None, position: ArrayLike | None = None, probe: Probe | None = None, approaches: bool = False, instances: ArrayLike | None = None, robots: ArrayLike | None = None) -> DataSet:
        """
        A data set of touches from elsewhere.

        `times` has three contact times per touch, in seconds on any clock, NaN for a finger that did not touch; they are
        rounded to microseconds, and the earliest becomes 0. `objects` says which of the `names` each touch is of.
        `direction` and `alignment` are unit vectors, `position` where the hand was at the first contact, on a table, in
        millimeters (the `probe` is in millimeters then). Without a `probe` nothing is known about it. `instances` are numbers
        that say which mesh, or recording, of its object each touch is of, where objects have several: a sequence is of one.
        `robots` are numbers that say which robot made each touch, where robots differ: a sequence is of one, too. The data set has
        the touches by object, instance and robot.
        """
    @staticmethod
    def from_pandas(table: DataFrame, *, probe: Probe | None = None, approaches: bool = False) -> DataSet:
        """
        A data set of a table with the columns of `to_pandas`; times are rounded to microseconds. Rows keep their order within an
        object. Without a `probe` nothing is known about it. Needs pandas.
        """
    @property
    def holds_approaches(self, /) -> bool:
        """
        True if every approach is kept, including those in which not all three fingers touched.
        """
    @property
    def instances(self, /) -> NDArray[int16]:
        """
        Number of the instance, recording or log of each touch, from 0: all touches of a sequence are from one.
        """
    @property
    def names(self, /) -> list[str]:
        """
        The objects' names, sorted.
        """
    def noisy(self, /, noise: str = "", timer: str = "", seed: SupportsIndex = 1) -> DataSet:
        """
        The touches with noise: `noise` is a standard deviation such as "5ms" or a range such as "0..10ms", `timer` the
        timer's resolution. Every touch is made by a robot of its own.
        """
    @property
    def objects(self, /) -> NDArray[int16]:
        """
        The object of each touch, as its position in the names.
        """
    @property
    def position(self, /) -> NDArray[float64] | None:
        """
        The position of the hand at each touch, in millimeters; `None` if no touch has one.
        """
    @property
    def probe(self, /) -> Probe | None:
        """
        The probe that made the touches, if known.
        """
    @staticmethod
    def read(directory: str | PathLike[str]) -> DataSet:
        """
        Reads the data set in a directory, which `capture` or `palpate capture` wrote, or which holds `<object>.txt`
        for each object.
        """
    @property
    def robots(self, /) -> NDArray[int64] | None:
        """
        Number of the robot that made each touch: all touches of a sequence are from one; `None` if robots do not differ.
        """
    def split(self, /, test_share: SupportsFloat | SupportsIndex = 0.1, seed: SupportsIndex = 1) -> tuple[DataSet, DataSet]:
        """
        Some touches to train on and others to test on: `test_share` of each object's touches are drawn for testing.
        """
    @property
    def times(self, /) -> NDArray[float64]:
        """
        Contact times in seconds after the first contact, one row of three per touch, NaN for a finger that did not touch.
        Columns are contiguous.
        """
    def to_pandas(self, /) -> DataFrame:
        """
        The touches as a table: object (a category), t1, t2 and t3, and, if known, direction, alignment and position by their
        axes, such as direction_x; instance, where objects have several, and robot, where robots differ. The columns are those of
        the arrays, without copies. Needs pandas, which also writes and reads Parquet.
        """
    def to_text(self, /, directory: str | PathLike[str]) -> None:
        """
        Writes `<object>.txt` for each object, or `<object>/1.txt`, `<object>/2.txt` and so on for its instances, recordings and robots,
        one line per touch, and, if the probe is known, `dataset.json`, into a directory that holds no touches yet: what `read` and
        `palpate train` read.
        """
    @property
    def warnings(self, /) -> list[str]:
        """
        Warnings from reading the data set, which may be about something intended.
        """

@final
class Ensemble:
    """
    The full model: boosted trees in f32, from `train` or from another library.

    >>> import palpate
    >>> data = palpate.capture(["bowl", "mouse"], touches=300)
    >>> ensemble = palpate.train(data, rounds=5)
    >>> ensemble.objects, ensemble.features, ensemble.trees
    (['bowl', 'mouse'], ['curvature', 'slope'], 5)
    """
    def __repr__(self, /) -> str: ...
    def _columns(self, /, header: SupportsGetItem[int, str]) -> tuple[list[int], str | None]:
        """
        The positions of the features among columns with these names, and a note about them.
        """
    def _splits(self, /) -> tuple[list[int], list[float], list[bool]]:
        """
        The feature and the threshold of each split, and whether a value that equals it goes left.
        """
    def _with_labels(self, /, labels: Any) -> Ensemble:
        """
        These trees as a classifier's whose classes have these labels, an array in their order: models predict them.
        """
    def _with_thresholds(self, /, thresholds: SupportsGetItem[int, SupportsFloat | SupportsIndex], names: SupportsGetItem[int, str] | None = None) -> Ensemble:
        """
        Copies the trees with other thresholds, in the order of `_splits`, and perhaps other names of features; values below them
        go left.
        """
    @property
    def descriptor(self, /) -> str | None:
        """
        The descriptor that turns touches into features; `None` for an ensemble over rows of features.
        """
    @property
    def features(self, /) -> list[str]:
        """
        The features' names.
        """
    @staticmethod
    def from_bytes(content: SupportsGetItem[int, SupportsIndex], names: SupportsGetItem[int, str] | None = None, *, all_trees: bool = False, missing: SupportsFloat | SupportsIndex | None = None, notes: SupportsGetItem[int, str] = ...) -> Ensemble:
        """
        Reads the bytes of such a file. `notes` are facts about it that it does not state.
        """
    @staticmethod
    def from_trees(kind: str, features: SupportsGetItem[int, str], base: SupportsGetItem[int, SupportsFloat | SupportsIndex], trees: SupportsGetItem[int, tuple[SupportsIndex | None, ArrayLike, ArrayLike, ArrayLike, ArrayLike, ArrayLike, ArrayLike]], *, names: SupportsGetItem[int, str] | None = None, notes: SupportsGetItem[int, str] = ..., link: str = "identity", last_of_ties: bool = False, targets: bool = False, probability: str = "softmax", compares_f64: bool = False) -> Ensemble:
        """
        An ensemble of trees in memory. Each tree is a tuple of columns with one entry per node: the output that its
        leaves are for (`None`: each leaf has a value for each output), the left child (where x <= threshold; negative in
        a leaf), the right child, the feature, the threshold, whether a missing value goes left, and the values. `base` is
        where margins start; an empty name stands for a feature that has none. `link` is "identity", "logistic",
        "exponential", "square" or "softplus": what makes a value of a margin. With `last_of_ties` the last of several
        largest margins names the class, otherwise the first. With `targets` each output is a value, and none is a class.
        `probability` is "softmax", "logistic", "shares" or "unknown": what makes probabilities of margins. With `compares_f64`
        the library compares values in f64, otherwise it rounds rows to f32 first.
        """
    @staticmethod
    def load(path: str | PathLike[str], names: SupportsGetItem[int, str] | None = None, *, all_trees: bool = False, missing: SupportsFloat | SupportsIndex | None = None) -> Ensemble:
        """
        Reads what `save` or `palpate train` wrote, or a model of XGBoost, LightGBM, CatBoost or ONNX; the content says
        which. `names` are the classes'. Where the file says that training stopped early, the trees up to the best
        iteration are taken, with `all_trees` all of them. `missing` is the number that stood for a missing value in
        training, beside NaN.
        """
    def margins(self, /, rows: ArrayLike) -> NDArray[float32]:
        """
        The margins of rows of features (of an ensemble over touches, of its descriptor's), one column per object: added
        in f32, as XGBoost does. The columns of a table are found by their names.
        """
    def margins_of(self, /, data: DataSet) -> NDArray[float32]:
        """
        The margins of each touch of a data set.
        """
    @property
    def notes(self, /) -> list[str]:
        """
        Caveats of an ensemble that another library trained, each a sentence.
        """
    @property
    def objects(self, /) -> list[str]:
        """
        The objects' (classes') names, in the order of the margins.
        """
    def save(self, /, path: str | PathLike[str]) -> None:
        """
        Writes an ensemble over touches as XGBoost's JSON.
        """
    @property
    def trees(self, /) -> int:
        """
        The number of trees.
        """

@final
class Locator:
    """
    Recognizes what lies on a table, and where, from touches of a hand that comes straight down and knows where it is; by the code
    that runs on the chip.

    >>> import palpate
    >>> probe = palpate.Probe(radius=1.5, spacing=15, speed=100, tilt=0, stroke=20)
    >>> maps = palpate.Maps.of_meshes(["bowl", "mouse"], probe=probe, millimeters=10)
    >>> locator = palpate.Locator(maps)
    >>> x, y, roll = locator.next()
    >>> located = locator.push_heights((None, 20.0, 17.0), x, y, roll, lowest=0.0)
    >>> located.state, located.touches
    ('undecided', 1)
    """
    def __new__(cls, /, maps: Maps, *, error_rate: SupportsFloat | SupportsIndex | None = None, max_touches: SupportsIndex | None = None, pose: SupportsIndex = 10, workspace: SupportsFloat | SupportsIndex | None = None, seed: SupportsIndex = 1) -> Locator:
        """
        It stops when the maps say so, or at a posterior of 1 - `error_rate`, and gives up after `max_touches`. `pose` is how much
        where the object lies counts in the choice of approaches, in 64ths, `workspace` how far from the table's origin the middle
        finger is sent in x and y, in millimeters (twice the maps' range; the outer ones reach beyond it by their distance from
        it), `seed` that of the choice.
        """
    @property
    def located(self, /) -> Located:
        """
        The verdict and the place after the last touch.
        """
    def next(self, /) -> tuple[float, float, float]:
        """
        Next approach: x and y of the middle finger in millimeters, and the roll of the row of fingers in degrees from the x
        axis. The same until another touch is taken in.
        """
    @property
    def posteriors(self, /) -> dict[str, float]:
        """
        The posterior of each object so far.
        """
    def push(self, /, times: Touch, position: Touch, alignment: ArrayLike) -> Located:
        """
        Takes in a touch: three contact times in seconds on any clock, `None` or NaN for a finger that touched nothing, neither
        object nor table; `position`, x, y and z in millimeters of the middle fingertip's lowest point at the first contact (or of
        the approach where there was none), 0 being the table; and `alignment`, the direction from the first finger to the third,
        a unit vector or degrees from the x axis, such as the roll that `next` gave.
        """
    def push_heights(self, /, heights: Touch, x: SupportsFloat | SupportsIndex, y: SupportsFloat | SupportsIndex, alignment: ArrayLike, *, lowest: SupportsFloat | SupportsIndex = 0.0) -> Located:
        """
        Takes in the heights above the table that three fingertips met, in millimeters, `None` or NaN for a finger that met nothing.
        `x` and `y` are the middle finger's, at most 2 m from the table's origin, `alignment` is as for `push`, and `lowest` is the
        height down to which the hand went, 0 or less where it would have met the table.
        """
    def reset(self, /, weights: SupportsGetItem[int, SupportsFloat | SupportsIndex] | None = None) -> None:
        """
        Forgets all touches, for the next object. `weights` say how often each object lies there, in any unit.
        """
    @property
    def touches(self, /) -> int:
        """
        The number of touches taken in since the last `reset`.
        """

@final
class Maps:
    """
    Height maps of objects as they lie on a table: the model of a `Locator`.

    >>> import palpate
    >>> probe = palpate.Probe(radius=1.5, spacing=15, speed=100, tilt=0, stroke=20)
    >>> maps = palpate.Maps.of_meshes(["bowl", "mouse"], probe=probe, millimeters=10)
    >>> maps.objects
    ['bowl', 'mouse']
    >>> maps.placements[0]
    ('bowl', '+z')
    >>> palpate.Maps(maps.to_bytes()).size == maps.size
    True
    """
    def __getnewargs__(self, /) -> tuple[bytes]:
        """
        The arguments that a pickle holds.
        """
    def __new__(cls, /, content: SupportsGetItem[int, SupportsIndex]) -> Maps:
        """
        Maps in memory; `content` is checked.
        """
    def __repr__(self, /) -> str: ...
    def calibrate(self, /, meshes: Meshes, *, millimeters: SupportsFloat | SupportsIndex | None = None, error_rate: SupportsFloat | SupportsIndex = 0.01, confidence: SupportsFloat | SupportsIndex = 0.95, sequences: SupportsIndex = 1000, max_touches: SupportsIndex = 25, aimed: str = "chosen", real: Real | None = None, pose: SupportsIndex = 10, until: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex] | None = None, unknown: bool = False, workspace: SupportsFloat | SupportsIndex | None = None, seed: SupportsIndex = 1, progress: Progress | None = None) -> CalibratedMaps:
        """
        Finds the loosest threshold at which at most a share of `error_rate` of the names is wrong, with a probability of
        `confidence`, on sequences of approaches to these meshes on a simulated table.

        `aimed` says how approaches are aimed, and which approaches the promise is for: "chosen" ones, as by `Locator.next`, or "random"
        ones about the place believed in. `real` is what the simulated hand and table add. `until` goes on after the name until the
        place is as sure, such as (3.0, 5.0) for 3 mm and 5 degrees. `unknown` makes a test for objects that the maps do not know: nothing
        is named before the eighth approach then. `workspace` is how far from the table's origin the middle finger comes down in x and
        y, in millimeters, by default twice the range.
        """
    def evaluate(self, /, meshes: Meshes, *, millimeters: SupportsFloat | SupportsIndex | None = None, sequences: SupportsIndex = 1000, max_touches: SupportsIndex = 25, aimed: str = "chosen", real: Real | None = None, pose: SupportsIndex = 10, until: tuple[SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex] | None = None, workspace: SupportsFloat | SupportsIndex | None = None, seed: SupportsIndex = 2, progress: Progress | None = None) -> MapsEvaluation:
        """
        Plays sequences of approaches to these meshes on a simulated table, other ones than those of `calibrate` if the seed is
        another, to the maps' own threshold. The arguments are as for `calibrate`.
        """
    @staticmethod
    def learn(data: DataSet, *, real: Real | None = None, cell: SupportsFloat | SupportsIndex = 1.0, range: SupportsFloat | SupportsIndex = 30.0, error_rate: SupportsFloat | SupportsIndex = 0.01, max_touches: SupportsIndex = 25) -> Maps:
        """
        Learns maps from recorded touches with positions.

        `real` is what is known of hand and table, `cell` the side of a map's cells (1 or 2 mm), `range` half of the side of the
        square about the table's origin in which objects are looked for, in millimeters.
        """
    @staticmethod
    def load(path: str | PathLike[str]) -> Maps:
        """
        Reads maps that `save` or the program wrote.
        """
    @property
    def objects(self, /) -> list[str]:
        """
        The objects' names.
        """
    @staticmethod
    def of_meshes(meshes: Meshes, *, probe: Probe, millimeters: SupportsFloat | SupportsIndex | None = None, real: Real | None = None, cell: SupportsFloat | SupportsIndex = 1.0, range: SupportsFloat | SupportsIndex = 30.0, error_rate: SupportsFloat | SupportsIndex = 0.01, max_touches: SupportsIndex = 25, progress: Progress | None = None) -> Maps:
        """
        Maps of meshes in every pose that they rest in: what a fingertip meets in the middle of each cell. Poses that look the same to
        contacts of this noise have one map.

        `meshes` are as for `capture`, at their true size: `millimeters` is the length of a unit of those that state none. The
        `probe` is in millimeters.
        """
    @property
    def placements(self, /) -> list[tuple[str, str]]:
        """
        The placements, each with its object's name first. Equal ones of an object are one.
        """
    @property
    def probe(self, /) -> Probe:
        """
        The hand that they were made with, in millimeters.
        """
    @property
    def promise(self, /) -> Any | None:
        """
        Promise of a calibration: its rate, the aims that it holds for, and its evidence; `None` without one.
        """
    @property
    def range(self, /) -> float:
        """
        Half of the side of the square about the table's origin in which objects are looked for, in millimeters.
        """
    def save(self, /, path: str | PathLike[str]) -> None:
        """
        Writes the maps, whole or not at all.
        """
    @property
    def size(self, /) -> int:
        """
        The size of the maps in bytes.
        """
    def to_bytes(self, /) -> bytes:
        """
        The maps' bytes, for the chip.
        """

@final
class Model:
    """
    A compiled model: the bytes that a microcontroller reads, and that are read here by the same code.

    >>> import palpate
    >>> data = palpate.capture(["bowl", "mouse"], touches=300)
    >>> model = palpate.compile(palpate.train(data, rounds=5))
    >>> model.objects
    ['bowl', 'mouse']
    >>> model.margins(data).shape
    (600, 2)
    >>> palpate.Model(model.to_bytes()).checksum == model.checksum
    True
    """
    def __getnewargs__(self, /) -> tuple[bytes]:
        """
        The arguments that a pickle holds.
        """
    def __new__(cls, /, content: SupportsGetItem[int, SupportsIndex]) -> Model:
        """
        A model in memory; `content` is checked.
        """
    def __repr__(self, /) -> str: ...
    def _columns(self, /, header: SupportsGetItem[int, str]) -> tuple[list[int], str | None]:
        """
        The positions of the features among columns with these names, and a note about them.
        """
    @property
    def checksum(self, /) -> int:
        """
        A number that identifies the model: models with the same number are the same.
        """
    @property
    def descriptor(self, /) -> str | None:
        """
        The descriptor that turns touches into features; `None` for a model over rows of features.
        """
    def emit(self, /, path: str | PathLike[str], *, form: str | None = None) -> list[Path]:
        """
        Writes the model as source code, and returns the files. `form` is "c" (an array), "rust", "c-code" (trees as C) or
        "rust-code" (trees as Rust); without it a name that ends in ".h" means "c", and ".rs" "rust". What has to be built with it,
        such as palpate.h, is written beside it, and for trees as Rust the model. Directories that are missing are made.
        """
    @property
    def features(self, /) -> list[str]:
        """
        The features' names.
        """
    @property
    def layout(self, /) -> str:
        """
        The layout of the trees.
        """
    @property
    def leaf(self, /) -> str:
        """
        The type of stored leaves: "i8", "i16" or "f32".
        """
    @staticmethod
    def load(path: str | PathLike[str]) -> Model:
        """
        Reads a model that `save` or `palpate export` wrote.
        """
    @property
    def margin_error(self, /) -> float:
        """
        The largest possible difference of a margin from the full model's, in nats, or of a value's: of several targets that of
        the one with the largest.
        """
    def margins(self, /, rows: DataSet | ArrayLike) -> NDArray[float64]:
        """
        The margins of each row, in nats, one column per object: unnormalized log-probabilities, to be added up over the
        touches of one object.

        A model over touches takes a data set, or rows of three contact times in seconds (NaN where a finger did not
        touch), with the probe's direction and alignment nine numbers. A model over features takes rows of those, NaN where
        one is missing; with leaves as f32 its margins are an XGBoost model's own, bit for bit, and those of a regression with
        other leaves have the digits that f32 values lack. Of a table (pandas, polars, pyarrow)
        the columns are found by their names, in any order and among others.
        """
    @property
    def notes(self, /) -> list[str]:
        """
        Facts about the model's source, each a sentence; none for a loaded model.
        """
    @property
    def objects(self, /) -> list[str]:
        """
        The objects' (classes') names, in the order of the margins.
        """
    def predict(self, /, rows: DataSet | ArrayLike, *, raw: bool = False) -> Predictions:
        """
        The prediction of the library that trained a model over rows of features, as an array: the class of each row, or its value
        (its values, a column for each of several targets), with `raw` the margin before the inverse link. Classes are the labels
        of the classifier, of its own type; without it (of a model or ensemble from a file or bytes), or with other `names`, they are
        the objects' names. Rows are as for `margins`.
        """
    def predict_proba(self, /, rows: DataSet | ArrayLike) -> NDArray[float64]:
        """
        The probabilities of each row's classes, one column per class, as `predict_proba` of the library that trained the model
        gives them: for margins within `margin_error`, within half of it for boosted trees. Rows are as for `margins`. A model
        that was loaded has none: its bytes do not say how probabilities are made of margins.
        """
    def save(self, /, path: str | PathLike[str]) -> None:
        """
        Writes the model, whole or not at all.
        """
    @property
    def size(self, /) -> int:
        """
        The size of the model in bytes.
        """
    def to_bytes(self, /) -> bytes:
        """
        The model's bytes, for the chip.
        """

@final
class Recognizer:
    """
    Recognizes objects by touch, by the code that runs on the chip.

    It stops when the model says so, or at a posterior of 1 - `error_rate`, and gives up after `max_touches`.

    >>> import palpate
    >>> model = palpate.compile(palpate.train(palpate.capture(["bowl", "mouse"], touches=1000)))
    >>> recognizer = palpate.Recognizer(model)
    >>> for touch in palpate.capture(["bowl", "fork"], touches=100, seed=2).times:
    ...     verdict = recognizer.push(touch)
    ...     if verdict.decided:
    ...         break
    >>> verdict.object
    'bowl'
    """
    def __new__(cls, /, model: Model, *, error_rate: SupportsFloat | SupportsIndex | None = None, max_touches: SupportsIndex | None = None) -> Recognizer: ...
    def _columns(self, /, header: SupportsGetItem[int, str]) -> tuple[list[int], str | None]:
        """
        The positions of the features among columns with these names, and a note about them.
        """
    @property
    def best(self, /) -> str:
        """
        The object with the most evidence so far, or the placement.
        """
    @property
    def posteriors(self, /) -> dict[str, float]:
        """
        The posterior of each output so far: of each object, or, of objects on a table, of each of their placements.
        """
    def push(self, /, touch: Touch) -> Verdict:
        """
        Takes in a touch: three contact times in seconds on any clock, `None` or NaN for a finger that did not touch, with
        the probe's direction and alignment nine numbers. A touch that the model was not trained for is not counted: the
        verdict says why.
        """
    def push_row(self, /, row: ArrayLike) -> Verdict:
        """
        Takes in a row of features, for a model over those, with NaN for a missing one. The features of a pandas series are
        found by their names. A model with a `position` counts it itself since the last `reset`: the row has the other features.
        """
    def reset(self, /, weights: SupportsGetItem[int, SupportsFloat | SupportsIndex] | None = None) -> None:
        """
        Forgets all touches, for the next object. `weights` say how often each object is touched, in place of the model's
        priors, in any unit.
        """
    @property
    def touches(self, /) -> int:
        """
        The number of touches counted since the last `reset`.
        """
    @property
    def verdict(self, /) -> Verdict:
        """
        The verdict after the last touch.
        """

@final
class Shape:
    """
    Learns the heights of one object that stands still on a table, and says where they are least known.

    `probe` is in millimeters, `workspace` how far from the table's origin the middle finger is sent in x and y, and `noise` the
    standard deviation of a contact's height, in millimeters.

    >>> import palpate
    >>> probe = palpate.Probe(radius=1.5, spacing=15, speed=100, tilt=0, stroke=20)
    >>> shape = palpate.Shape(probe, workspace=20)
    >>> while shape.known(2.0) < 0.5 and shape.touches < 40:
    ...     x, y, roll = shape.next()
    ...     shape.push_heights((10.0, 10.0, 10.0), x, y, roll)
    >>> shape.heights.shape, bool(abs(shape.heights[22, 22] - 10) < 1)
    ((45, 45), True)
    """
    def __new__(cls, /, probe: Probe, *, workspace: SupportsFloat | SupportsIndex = 60.0, noise: SupportsFloat | SupportsIndex = 0.5) -> Shape: ...
    @property
    def bounds(self, /) -> tuple[NDArray[float64], NDArray[float64]]:
        """
        The least and the greatest height of each cell: nineteen of twenty such intervals hold the truth, of cells within 8 mm of a
        touch. Others have the interval from the table to the highest height so far, which states nothing.
        """
    @property
    def heights(self, /) -> NDArray[float64]:
        """
        Heights in millimeters on a grid of 1 mm about the origin, a row for each y, ascending.
        """
    def known(self, /, millimeters: SupportsFloat | SupportsIndex) -> float:
        """
        Share of the cells that may be the object's whose height is known to some millimeters.
        """
    def mesh(self, /) -> tuple[list[list[float]], list[list[int]]]:
        """
        The surface, closed to the table: vertices in millimeters, and triangles.
        """
    def next(self, /) -> tuple[float, float, float]:
        """
        The next approach: x and y of the middle finger in millimeters, and the roll of the row in degrees from the x axis.
        """
    def push(self, /, times: Touch, position: Touch, alignment: ArrayLike) -> None:
        """
        Takes in a touch, as `Locator.push` does.
        """
    def push_heights(self, /, heights: Touch, x: SupportsFloat | SupportsIndex, y: SupportsFloat | SupportsIndex, alignment: ArrayLike, *, lowest: SupportsFloat | SupportsIndex = 0.0) -> None:
        """
        Takes in heights, as `Locator.push_heights` does.
        """
    @property
    def touches(self, /) -> int:
        """
        The number of touches taken in.
        """

@final
class Surface:
    """
    A mesh that spheres are cast at: exact first contacts with its triangles, found through a tree of bounding boxes.

    `vertices` are rows of three numbers, in any unit, and are kept as float32; `faces` are rows of three positions among
    them.

    >>> import palpate
    >>> square = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
    >>> surface = palpate.Surface(square, [[0, 1, 2], [0, 2, 3]])
    >>> surface.first_contact([[0, 0, 5], [9, 9, 5]], [[0, 0, -1]], radius=0.5)
    array([4.5, nan])
    """
    def __new__(cls, /, vertices: ArrayLike, faces: ArrayLike) -> Surface: ...
    def __repr__(self, /) -> str: ...
    @property
    def bounds(self, /) -> tuple[list[float], list[float]]:
        """
        The lowest and the highest corner of the bounding box.
        """
    def first_contact(self, /, origins: ArrayLike, directions: ArrayLike, radius: SupportsFloat | SupportsIndex) -> NDArray[float64]:
        """
        First contact of a sphere that starts at each origin and moves along its direction: the t at which its center is
        at origin + t * direction; 0 if it starts in contact, NaN if it never touches. One row of `directions` serves all.
        """
    @property
    def triangles(self, /) -> int:
        """
        The number of triangles.
        """

def calibrate(model: Model, rows: ArrayLike, labels: SupportsGetItem[int, str], sequence: SupportsGetItem[int, str], *, groups: SupportsGetItem[int, str] | None = None, error_rate: SupportsFloat | SupportsIndex = 0.01, per: str = "average", confidence: SupportsFloat | SupportsIndex = 0.95, max_rows: SupportsIndex | None = None, strangers: str | None = None, background: ArrayLike | None = None, background_sequence: SupportsGetItem[int, str] | None = None, guard: bool = False, learned: SupportsGetItem[int, tuple[Model, ArrayLike, SupportsGetItem[int, str], SupportsGetItem[int, str], SupportsGetItem[int, str] | None]] | None = None, seed: SupportsIndex = 1, progress: Progress | None = None) -> tuple[Model, str]:
    """
    Sets a model's thresholds on sequences of rows, and returns the model and what `palpate rows calibrate --json` prints.
    """

def capture(meshes: Meshes, *, touches: SupportsIndex = 21000, seed: SupportsIndex = 1, probe: Probe | None = None, approaches: bool | SupportsIndex = ..., pose: bool = False, aim: str = "box", cone: SupportsFloat | SupportsIndex | None = None, length: SupportsFloat | SupportsIndex = 10.0, millimeters: SupportsFloat | SupportsIndex | None = None, instances: bool = False, samples: tuple[SupportsIndex, SupportsIndex] | None = None, out: str | PathLike[str] | None = None, force: bool = False, threads: SupportsIndex | None = None, progress: Progress | None = None) -> DataSet:
    """
    Touches objects with a simulated probe.

    `meshes` are files, directories or built-in objects as `palpate capture` takes them, such as "meshes/" or
    ["bowl", "cup.obj"], or a mapping from names to files, to pairs of arrays (vertices, faces) or to meshes of trimesh. Each is
    scaled so that its longest side has `length` units; with `millimeters`, the length of a unit of the meshes, it keeps
    its true size and the `probe` is in millimeters.

    `touches` full touches of each object are kept, or with `approaches=True` that many approaches whether fingers touch or not;
    `approaches=500` are 500 approaches. `pose` keeps the probe's direction and alignment. With `cone` the objects lie on a
    table in each of their placements, and approaches come within that many degrees of straight down. The same
    `seed` gives the same touches on any number of `threads`, and the same as the program's. `samples` are the first of
    a part of these touches or approaches, from 0, and the one after its last. With `instances` a directory inside a directory
    is one object. With `out` the touches are written there as `palpate capture` does: `force` is its option.

    `progress` is called with a stage, the steps done and their number. Ctrl-C stops the call.

    >>> import palpate
    >>> data = palpate.capture(["bowl", "mouse"], touches=100, seed=7)
    >>> data
    DataSet(200 touches of 2 objects)
    >>> data.times.shape, bool(data.times.min() == 0.0)
    ((200, 3), True)
    """

def checksums(meshes: Meshes) -> list[tuple[str, list[str]]]:
    """
    The checksums of the meshes that each object is touched as, as `dataset.json` states them: the names, sorted, with those of
    their instances. All files are read.
    """

def compile(ensemble: Ensemble, *, max_bytes: SupportsIndex | None = None, leaf: str | None = None, error_rate: SupportsFloat | SupportsIndex = 0.01, max_touches: SupportsIndex = 200, priors: SupportsGetItem[int, SupportsFloat | SupportsIndex] | None = None, scales: SupportsGetItem[int, SupportsFloat | SupportsIndex] | None = None, row_number: str | None = None) -> Model:
    """
    Compiles an ensemble to the bytes that a microcontroller reads. (`palpate.compile` also takes models of other
    libraries.)

    `leaf` is "i8", "i16" or "f32": what leaves are stored as; by default what `palpate export` chooses. With `max_bytes` leaves
    are stored in fewer bits where the model would be larger; if it still is, that is an error. `error_rate` and `max_touches` are where recognizers stop; `priors` say
    how likely each object is. `scales` say how many units make up 1 of each feature, for a chip that measures in whole numbers.
    `row_number` names the feature that is a row's number in its sequence, counted from 1.

    >>> import palpate
    >>> data = palpate.capture(["bowl", "mouse"], touches=300)
    >>> model = palpate.compile(palpate.train(data, rounds=5), max_bytes=4000)
    >>> model.size <= 4000
    True
    """

def estimate_sequences(model: Model, folds: SupportsGetItem[int, tuple[Model, ArrayLike, SupportsGetItem[int, str], SupportsGetItem[int, str], SupportsGetItem[int, str] | None]], *, error_rate: SupportsFloat | SupportsIndex, max_rows: SupportsIndex | None, guard: bool) -> tuple[Model, str]:
    """
    Sets a model's threshold from the folds of its training, and returns the model and an estimate of its error rate.
    """

def evaluate(model: Model | Ensemble, data: DataSet, *, at: SupportsGetItem[int, SupportsIndex] | None = None, groups: SupportsIndex = 1000, error_rate: SupportsFloat | SupportsIndex | None = None, max_touches: SupportsIndex | None = None, noise: str = "", timer: str = "", seed: SupportsIndex = 1) -> str:
    """
    Evaluates a model on touches that it was not trained on, and returns what `palpate evaluate --json` prints.
    """

def evaluate_sequences(model: Model, rows: ArrayLike, labels: SupportsGetItem[int, str], sequence: SupportsGetItem[int, str], *, groups: SupportsGetItem[int, str] | None = None, error_rate: SupportsFloat | SupportsIndex | None = None, max_rows: SupportsIndex | None = None) -> str:
    """
    Measures a model on sequences of rows, and returns what `palpate rows evaluate --json` prints.
    """

def parity(ensemble: Ensemble, model: Model, data: DataSet, *, sequences: SupportsIndex = 10000, seed: SupportsIndex = 1, progress: Progress | None = None) -> str:
    """
    Compares a compiled model with its ensemble on every touch of a data set and on random sequences, and returns what
    `palpate verify --json` prints.
    """

def sources(meshes: SupportsGetItem[int, str | PathLike[str]]) -> list[tuple[str, str]]:
    """
    The objects that sources stand for: their names, sorted, and what `capture` takes for each alone. Nothing is read.
    """

def train(data: DataSet, *, preset: str = "compact", descriptor: str | None = None, counted: str | None = None, rounds: SupportsIndex | None = None, depth: SupportsIndex | None = None, eta: SupportsFloat | SupportsIndex | None = None, min_child_weight: SupportsFloat | SupportsIndex | None = None, bins: SupportsIndex | None = None, leaf_bits: SupportsIndex | None = None, multi_output: bool | None = None, noise: str = "", timer: str = "", outputs: str = "placements", background: DataSet | None = None, seed: SupportsIndex = 1, threads: SupportsIndex | None = None, progress: Progress | None = None) -> Ensemble:
    """
    Trains an ensemble on a data set: gradient boosting with XGBoost's algorithm and parameters.

    `preset` is "compact" (30 trees with one leaf value per object, on curvature and slope), "small" or "tiny" (two fifths
    of its bytes, or a seventh) or "paper" (the published method); other arguments replace parts of it. `descriptor` is
    "times", "curvature", "gravity" or "oriented". `counted` says which touches are evidence: "full", "contacts" or "all"; by
    default those with a contact of a data set of approaches, and full ones of others. `noise` and `timer`, such as "0..5ms" and
    "1ms", are added to the touches.
    With objects on a table each placement is an output, or with `outputs` "objects" each object.
    `background` is a data set of many other shapes, which stand for everything that the model does not know.

    >>> import palpate
    >>> data = palpate.capture(["bowl", "mouse"], touches=300)
    >>> palpate.train(data, rounds=5, noise="0..5ms", timer="1ms")
    Ensemble(5 trees, curvature, 2 objects)
    """
