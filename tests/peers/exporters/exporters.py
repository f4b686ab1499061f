"""Each exporter: an ensemble to C or C++ with `peer_start` and `peer_class`, or a static library with them."""

import json
import os
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[2]
START = "int peer_start(void) { return 0; }\n"
BEST = """
static int best(const float *margins, int count)
{
    int best = 0, i;
    for (i = 1; i < count; i++) {
        if (margins[i] > margins[best]) {
            best = i;
        }
    }
    return best;
}
"""


class Refused(Exception):
    """The exporter does not take the ensemble."""


class Source:
    """Input of the compiler: files, flags, and a static library to link; the rows' classes if the ensemble is the exporter's own."""

    def __init__(self, files, flags=(), library=None, expected=None, clang=False):
        self.files, self.flags, self.library, self.expected = files, list(flags), library, expected
        # True to see how long clang takes, too.
        self.clang = clang


def write(directory, name, text):
    path = directory / name
    path.write_text(text)
    return path


def tl2cgen(ensemble, directory, quantize):
    import tl2cgen as exporter
    import treelite

    if ensemble.is_forest:
        raise Refused("see touches")
    model = treelite.frontend.load_xgboost_model(ensemble.path)
    exporter.generate_c_code(model, dirpath=directory, params={"quantize": int(quantize)})
    features = ensemble.rows.shape[1]
    wrapper = f"""#include "header.h"
{START}{BEST}
int peer_class(const float *row)
{{
    union Entry data[{features}];
    float result[{ensemble.outputs}] = {{0}};
    int i;
    for (i = 0; i < {features}; i++) {{
        if (row[i] == row[i]) {{
            data[i].fvalue = row[i];
        }} else {{
            data[i].missing = -1;
        }}
    }}
    predict(data, 1, result);
    return best(result, {ensemble.outputs});
}}
"""
    return Source([write(directory, "peer.c", wrapper), *directory.glob("main.c"), *directory.glob("quantize.c"), *directory.glob("tu*.c")])


def m2cgen(ensemble, directory):
    import m2cgen as exporter

    if ensemble.model is None:
        raise Refused("takes objects of Python, not files")
    sys.setrecursionlimit(10_000)
    code = exporter.export_to_c(ensemble.model)
    features = ensemble.rows.shape[1]
    wrapper = f"""{START}
int peer_class(const float *row)
{{
    double input[{features}], output[{ensemble.outputs}];
    int i, best = 0;
    for (i = 0; i < {features}; i++) {{
        input[i] = row[i];
    }}
    score(input, output);
    for (i = 1; i < {ensemble.outputs}; i++) {{
        if (output[i] > output[best]) {{
            best = i;
        }}
    }}
    return best;
}}
"""
    return Source([write(directory, "peer.c", code + wrapper)])


def micromlgen(ensemble, directory):
    from micromlgen import port

    if ensemble.model is None:
        raise Refused("takes objects of Python, not files")
    code = port(ensemble.model)
    name = "RandomForest" if ensemble.is_forest else "XGBClassifier"
    wrapper = f"""#include <stdint.h>
{code}
extern "C" {START}
extern "C" int peer_class(const float *row)
{{
    static Eloquent::ML::Port::{name} model;
    return model.predict(const_cast<float *>(row));
}}
"""
    return Source([write(directory, "peer.cc", wrapper)])


def timber(ensemble, directory):
    if ensemble.is_forest:
        raise Refused("see touches")
    command = [Path(sys.executable).with_name("timber"), "compile", "--model", ensemble.path, "--out", directory]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise Refused(done.stderr.strip().splitlines()[-1])
    wrapper = f"""#include "model.h"
{BEST}
static TimberCtx *model;
int peer_start(void)
{{
    return timber_init(&model);
}}
int peer_class(const float *row)
{{
    float result[{ensemble.outputs}];
    timber_infer_single(row, result, model);
    return best(result, {ensemble.outputs});
}}
"""
    # Its header does not declare this one.
    declaration = "int timber_infer_single(const float *, float *, const TimberCtx *);\n"
    wrapper = wrapper.replace('#include "model.h"\n', '#include "model.h"\n' + declaration)
    return Source([write(directory, "peer.c", wrapper), directory / "model.c"])


def emlearn(ensemble, directory, method, dtype="int16_t", leaf_bits=8):
    import emlearn as exporter

    if not ensemble.is_forest:
        # The first of its variants says so.
        raise Refused("no boosted trees" if method == "loadable" else "see touches")
    converted = exporter.convert(ensemble.model, method=method, dtype=dtype, leaf_bits=leaf_bits)
    converted.save(file=directory / "model.h", name="model", include_proba=False)
    features = ensemble.rows.shape[1]
    if dtype == "float":
        body = f"    return model_predict(row, {features});\n"
    else:
        body = f"""    {dtype} features[{features}];
    int i;
    for (i = 0; i < {features}; i++) {{
        features[i] = ({dtype})row[i];
    }}
    return model_predict(features, {features});
"""
    wrapper = f"""#include "model.h"
{START}
int peer_class(const float *row)
{{
{body}}}
"""
    return Source([write(directory, "peer.c", wrapper)], ["-I", exporter.includedir])


def ydf(ensemble, directory):
    import ydf as exporter

    sizes = {"wine": (10, 4), "digits": (100, 6)}
    if ensemble.name not in sizes:
        raise Refused("exports models of its own only")
    trees, depth = sizes[ensemble.name]
    from sklearn.datasets import load_digits, load_wine

    x, y = (load_wine if ensemble.name == "wine" else load_digits)(return_X_y=True)
    columns = lambda rows: {f"f{index}": rows[:, index] for index in range(rows.shape[1])}
    learner = exporter.GradientBoostedTreesLearner(label="y", num_trees=trees, max_depth=depth, validation_ratio=0.0)
    model = learner.train({**columns(x.astype(np.float32)), "y": y}, verbose=0)
    code = model.to_standalone_cc(name="model", algorithm="ROUTING", classification_output="CLASS")
    expected = np.asarray(model.predict(columns(ensemble.rows))).argmax(axis=1)
    wrapper = f"""{code}
extern "C" {START}
extern "C" int peer_class(const float *row)
{{
    model::Instance instance;
    std::memcpy(&instance, row, sizeof(instance));
    return static_cast<int>(model::Predict(instance));
}}
"""
    return Source([write(directory, "peer.cc", wrapper)], expected=expected)


def irithyll(ensemble, directory):
    if ensemble.is_forest:
        raise Refused("see touches")
    learner = json.loads(ensemble.path.read_text())["learner"]
    forest = learner["gradient_booster"]["model"]
    base = [float(part) for part in learner["learner_model_param"]["base_score"].strip("[]").split(",")]
    features = ensemble.rows.shape[1]
    out = b""
    for output in range(ensemble.outputs):
        trees = [tree for tree, info in zip(forest["trees"], forest["tree_info"]) if info == output]
        table, nodes = b"", b""
        for tree in trees:
            table += struct.pack("<II", len(tree["left_children"]), len(nodes))
            columns = zip(tree["left_children"], tree["right_children"], tree["split_indices"], tree["split_conditions"])
            for left, right, feature, cut in columns:
                if left == -1:
                    nodes += struct.pack("<fHHHH", cut, 0, 0, 0x8000, 0)
                else:
                    # It goes right above a threshold, XGBoost at one.
                    with np.errstate(under="ignore"):
                        below = np.nextafter(np.float32(cut), np.float32(-np.inf))
                    nodes += struct.pack("<fHHHH", below, left, right, feature, 0)
        part = b"IRIT" + struct.pack("<HHHHf", 1, len(trees), features, 0, base[output % len(base)]) + table + nodes
        out += struct.pack("<I", len(part)) + part
    (directory / "model.bin").write_bytes(out)
    return rust(ensemble, directory, directory / "model.bin", ["irithyll"])


def run_export(command):
    done = subprocess.run([*command, "--json"], capture_output=True, text=True)
    if done.returncode != 0:
        raise Refused(done.stderr.strip().splitlines()[-1])
    return json.loads(done.stdout)


def export(palpate, ensemble, directory, leaf):
    command = [palpate, "export", ensemble.path, "-o", directory / "model.palpate", "--leaf", leaf]
    return run_export([*command, "--emit", "c"])


def ours_c(ensemble, directory, palpate, leaf):
    exported = export(palpate, ensemble, directory, leaf)
    features = ensemble.rows.shape[1]
    answer = f"""    palpate_margins_of(&model, features, {features}, margins, {ensemble.outputs});
    for (i = 1; i < {ensemble.outputs}; i++) {{
        if (margins[i] > margins[best]) {{
            best = i;
        }}
    }}
    return best;
"""
    # Rows of f32, or whole numbers.
    key = "palpate_f32_key(row[i])" if "features" in exported else "row[i] == row[i] ? (int32_t)row[i] : INT32_MIN"
    wrapper = f"""#include "model.h"
static palpate_model model;
int peer_start(void)
{{
    return palpate_open(&model, model_model, sizeof model_model) != PALPATE_OK;
}}
int peer_class(const float *row)
{{
    int32_t features[{ensemble.rows.shape[1]}], margins[{ensemble.outputs}];
    int i, best = 0;
    for (i = 0; i < {ensemble.rows.shape[1]}; i++) {{
        features[i] = {key};
    }}
{answer}}}
"""
    return Source([write(directory, "peer.c", wrapper)])


def ours_code(ensemble, directory, palpate):
    command = [palpate, "export", ensemble.path, "-o", directory / "model.palpate", "--emit", "c-code"]
    exported = run_export(command)
    features = ensemble.rows.shape[1]
    call = "    model_margins(row, margins);\n"
    if "features" not in exported:  # whole numbers
        call = f"    int32_t whole[{features}];\n    for (i = 0; i < {features}; i++) {{\n        "
        call += "whole[i] = row[i] == row[i] ? (int32_t)row[i] : INT32_MIN;\n    }\n    model_margins(whole, margins);\n"
    wrapper = f"""#include "model.h"
{START}
int peer_class(const float *row)
{{
    int32_t margins[{ensemble.outputs}];
    int i, best = 0;
{call}    for (i = 1; i < {ensemble.outputs}; i++) {{
        if (margins[i] > margins[best]) {{
            best = i;
        }}
    }}
    return best;
}}
"""
    return Source([write(directory, "peer.c", wrapper)], clang=True)


def ours_rust(ensemble, directory, palpate, leaf):
    exported = export(palpate, ensemble, directory, leaf)
    features = ["palpate", exported["layout"], f"{leaf}-leaves"]
    features += [feature for feature, key in [("shared-leaves", "shared_leaves"), ("real", "features")] if key in exported]
    return rust(ensemble, directory, directory / "model.palpate", features)


def rust(ensemble, directory, model, features):
    """A static library for the chip that is built for; see `compare.py`."""

    def library(target):
        command = ["cargo", "build", "--release", "--quiet", "--target", target, "--features", ",".join(features)]
        environment = {**os.environ, "PEER_MODEL": str(model), "CARGO_TARGET_DIR": str(HERE / "rust/target")}
        environment["PEER_FEATURES"], environment["PEER_CLASSES"] = str(ensemble.rows.shape[1]), str(ensemble.outputs)
        subprocess.run(command, cwd=HERE / "rust", env=environment, check=True)
        built = HERE / "rust/target" / target / "release/libpalpate_exporters.a"
        copy = directory / f"{target}.a"
        copy.write_bytes(built.read_bytes())
        return copy

    return Source([], library=library)
