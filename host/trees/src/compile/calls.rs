//! Writes C functions for a model that is a constant: from a row to its class, value or probabilities, and from steps to a
//! verdict.

use super::container::parts;
use super::cost::has_sequences;
use super::legend::Legend;
use super::model::bound_of;
use crate::ensemble::Probability;
use palpate_onboard::Model;
use palpate_shared::Descriptor;
use palpate_shared::format::{Axis, CHECKSUM_LENGTH, Key, Link, RowEvidence, Tag};
use std::fmt::Write as _;

/// A model that C functions are written for.
pub(super) struct Calls<'a> {
    pub(super) model: &'a Model<'a>,
    pub(super) legend: &'a Legend<'a>,
    /// Prefix of all names.
    pub(super) name: &'a str,
    pub(super) probability: Probability,
    /// True if the trees are code.
    pub(super) is_code: bool,
}

impl Calls<'_> {
    /// The model as `palpate_open` leaves it, and the functions that read it.
    pub(super) fn text(&self) -> String {
        let mut text = self.opened() + &self.legend.c(self.name);
        if self.model.descriptor().is_none() {
            text += &self.row_functions();
        }
        if self.model.object_count() > 1 && !self.model.prediction().targets {
            text += &self.step_functions();
        }
        let name = self.name;
        text + &format!(
            "/* PALPATE_OK if the model's bytes have their checksum, else PALPATE_CHECKSUM. {SAFE} */\n\
             static inline palpate_error {name}_check(void)\n{{\n    return palpate_check_(&{name}_opened_);\n}}\n\n"
        )
    }

    /// The constant, field by field as `palpate_model` declares them.
    fn opened(&self) -> String {
        let (name, model, header) = (self.name, self.model, self.model.header());
        let bytes = model.bytes();
        let parts = parts(model);
        let checksum = &bytes[bytes.len() - CHECKSUM_LENGTH..];
        let pointer_to = |part: &[u8]| format!("{name}_model + {}", part.as_ptr().addr() - bytes.as_ptr().addr());
        let pointer = |part: Option<&[u8]>| part.map_or_else(|| "NULL".into(), pointer_to);
        let section = |tag: Tag| {
            pointer(model.optional_sections().find(|section| section.tag == tag.code()).map(|section| section.content))
        };
        let trained = model.trained_touches();
        let last_point = |row: RowEvidence<'_>| ((row.len() as u32 - 1) << row.shifts.between) - 1;
        let code = if self.is_code { format!("{name}_code_") } else { "NULL".into() };
        format!(
            "/* The model as palpate_open leaves it: its bytes were checked when it was exported. */\n\
             static const palpate_model {name}_opened_ = {{\n    {name}_model,\n    {{{parts}}},\n    \
             {cuts}, {odds}, {strangers}, {table}, {sentinel}, {weights}, {rows}, {start}, {most}u,\n\
             #if PALPATE_SEQUENCES\n    {position}, {guard},\n#endif\n\
             #if PALPATE_OUTPUTS\n    {outputs},\n#endif\n    \
             0, {spread}u, {objects}, {known}, {features}, {layout}, {leaf}, {descriptor}, {real}, {patterns}, {oriented}\n\
             #if PALPATE_LAYOUTS & PALPATE_CODE\n    , {code}\n#endif\n}};\n\n",
            parts = parts.into_iter().chain([checksum]).map(pointer_to).collect::<Vec<_>>().join(", "),
            cuts = pointer_to(&parts[3][Axis::LENGTH * usize::from(header.axes())..]),
            odds = section(Tag::ThresholdsByObject),
            strangers = section(Tag::Strangers),
            table = pointer(model.shared_leaves().map(|shared| shared.values())),
            sentinel = section(Tag::Sentinel),
            weights = section(Tag::Weights),
            rows = section(Tag::RowEvidence),
            start = model.row_evidence().map_or(0, |row| row.start),
            most = model.row_evidence().map_or(0, last_point),
            position = section(Tag::Position),
            guard = section(Tag::Guard),
            outputs = section(Tag::Outputs),
            spread = trained.largest_spread,
            objects = model.object_count(),
            known = model.known_count(),
            features = model.feature_count(),
            layout = header.layout(),
            leaf = header.leaf(),
            descriptor = header.descriptor(),
            real = header.key(),
            patterns = trained.patterns.bits(),
            oriented = u8::from(trained.needs_pose),
        )
    }

    /// True if the descriptor has directions.
    fn is_oriented(&self) -> bool {
        self.model.descriptor().is_some_and(Descriptor::needs_pose)
    }

    /// The C type of a row's features, and the value of a missing one.
    fn row(&self) -> (&'static str, &'static str) {
        if self.model.key() == Key::Real { ("float", "NaN") } else { ("int32_t", "INT32_MIN") }
    }

    /// Lines that make keys of a row, and the keys' name.
    fn keys(&self) -> (String, &'static str) {
        let (name, features) = (self.name, self.model.feature_count());
        match self.model.key() {
            Key::Whole => (String::new(), "row"),
            Key::Real => (format!("    int32_t keys[{features}];\n    {name}_keys_(row, keys);\n"), "keys"),
        }
    }

    /// Lines that add up the trees for a row.
    fn sums(&self) -> String {
        let (name, objects, features) = (self.name, self.model.object_count(), self.model.feature_count());
        if self.is_code {
            return format!("    uint32_t sums[{objects}];\n    {name}_margins(row, PALPATE_AT_(int32_t *, sums));\n");
        }
        let (lines, keys) = self.keys();
        format!("    uint32_t sums[{objects}];\n{lines}    palpate_sum_(&{name}_opened_, {keys}, {features}, sums);\n")
    }

    /// Functions that predict from a row.
    fn row_functions(&self) -> String {
        let (name, objects, features) = (self.name, self.model.object_count(), self.model.feature_count());
        let (row, missing) = self.row();
        let mut text = String::new();
        if (self.is_code, row) == (false, "float") {
            text += &format!(
                "static inline void {name}_keys_(const float *row, int32_t *keys)\n{{\n    int i;\n    \
                 for (i = 0; i < {features}; i++) {{\n        keys[i] = palpate_f32_key(row[i]);\n    }}\n}}\n\n"
            );
        }
        let sums = self.sums();
        let mut call = |about: &str, stated: &str, kind: &str, function: &str, more: &str, body: &str| {
            _ = write!(
                text,
                "/* {about} of a row of {features} features, {missing} where one is missing.{stated} {SAFE} */\n\
                 static inline {kind} {name}_{function}(const {row} *row{more})\n{{\n{body}}}\n\n"
            );
        };
        if objects == 1 || self.model.prediction().targets {
            let (about, kind, function, parameter) = match objects {
                1 => ("The value".to_owned(), "float", "value", ""),
                _ => (format!("The {objects} values"), "void", "values", ", float *values"),
            };
            let body = |call: &str| match objects {
                1 => format!("    float value;\n{sums}    {call}(&{name}_opened_, sums, &value);\n    return value;\n"),
                _ => format!("{sums}    {call}(&{name}_opened_, sums, values);\n"),
            };
            let (bounds, offsets) = self.accuracy();
            call(&about, &bounds, kind, function, parameter, &body("palpate_values_of_"));
            if let Some(offsets) = offsets {
                let function = format!("{function}_without_offset");
                let about = format!("{about}, less {offsets},");
                call(&about, &bounds, kind, &function, parameter, &body("palpate_differences_of_"));
            }
        } else {
            let body = if self.is_code {
                format!(
                    "    int32_t margins[{objects}];\n    {name}_margins(row, margins);\n    return {name}_best_(margins);\n"
                )
            } else {
                let (lines, keys) = self.keys();
                format!(
                    "    int32_t margins[{objects}];\n{lines}    \
                     return palpate_predict_class(&{name}_opened_, {keys}, {features}, margins, {objects});\n"
                )
            };
            let about = format!("The class (the index in: {})", self.legend.listed());
            call(&about, "", "int", "predict", "", &body);
            let body = match self.probability {
                Probability::Unknown => return text,
                Probability::Shares => format!("{sums}    palpate_values_of_(&{name}_opened_, sums, posteriors);\n"),
                Probability::Softmax | Probability::Logistic => {
                    let apart = u8::from(self.probability == Probability::Logistic);
                    format!("{sums}    palpate_posteriors_of_(&{name}_opened_, sums, {apart}, posteriors);\n")
                }
            };
            let of_f32 = if row == "float" { " for f32 values" } else { "" };
            let about = format!("The {objects} probabilities, within {:.1e} of the library's{of_f32},", self.bound());
            call(&about, "", "void", "posteriors", ", float *posteriors", &body);
        }
        text
    }

    /// A sentence on how close values are to the library's; and the offsets that another function leaves out, if values are margins
    /// with offsets.
    fn accuracy(&self) -> (String, Option<String>) {
        let prediction = self.model.prediction();
        let outputs = 0..self.model.object_count();
        let bounds = outputs.clone().map(|output| format!("{:.1e}", bound_of(self.model, output)));
        let bounds = format!(" Margins are within {} of the library's", bounds.collect::<Vec<_>>().join(", "));
        let offsets: Vec<f32> =
            outputs.filter_map(|output| self.model.output_scale(output).map(|scale| scale.offset)).collect();
        if offsets.is_empty() || prediction.link != Link::Identity || prediction.average != 1 {
            return (bounds + ".", None);
        }
        let step = |offset: &f32| format!("{} near {offset}", offset.abs().next_up() - offset.abs());
        let steps: Vec<String> = offsets.iter().map(step).collect();
        let list: Vec<String> = offsets.iter().map(ToString::to_string).collect();
        (format!("{bounds}; an f32 steps by {}.", steps.join(", ")), Some(list.join(", ")))
    }

    /// Largest difference of a probability from the library's.
    fn bound(&self) -> f32 {
        // A softmax changes by half as much as its margins at most.
        let margin = self.model.margin_error();
        let margin = match self.probability {
            Probability::Shares => margin * self.model.prediction().scale,
            _ => margin / 2.0,
        };
        (margin + 1e-6) * 1.06
    }

    /// Functions that add up rows of a stream, or steps of a model that computes its features.
    fn step_functions(&self) -> String {
        let (name, objects, features) = (self.name, self.model.object_count(), self.model.feature_count());
        if has_sequences(self.model) {
            return self.sequence_functions();
        }
        let (step, parameter, body) = if self.model.descriptor().is_none() {
            let body = if self.is_code {
                format!(
                    "    int32_t margins[{objects}];\n    {name}_margins(row, margins);\n    \
                     palpate_push_margins(state, margins, {objects});\n"
                )
            } else {
                let (lines, keys) = self.keys();
                format!("{lines}    (void)palpate_push_features(state, {keys}, {features});\n")
            };
            let parameter = format!("const {} *row", self.row().0);
            ("a row of a stream", parameter, body + "    return palpate_decided_(state);\n")
        } else if self.is_oriented() {
            let body = "    return palpate_add_step_(state, step);\n".to_owned();
            ("a step", "const palpate_step *step".into(), body)
        } else {
            let times = "a step by its three times in microseconds, PALPATE_MISSING for one that there is not";
            (times, "const uint32_t *times".into(), "    return palpate_add_times_(state, times);\n".to_owned())
        };
        format!(
            "/* Begins: nothing was added yet. {OWN} */\n\
             static inline void {name}_begin(palpate_recognizer *state)\n{{\n    palpate_start_(state, &{name}_opened_);\n}}\n\n\
             /* Adds {step}: the index of the object that is recognized; -1 while none is, -2 if none fits, -3 at the limit of \
             steps. After a decision nothing changes until {name}_begin. {OWN} */\n\
             static inline int {name}_push(palpate_recognizer *state, {parameter})\n{{\n{body}}}\n\n\
             /* The decision at the end, or without one the object with the most evidence; -1 if nothing was added. {OWN} */\n\
             static inline int {name}_end(const palpate_recognizer *state)\n{{\n    return palpate_ended_(state);\n}}\n\n"
        )
    }

    /// Functions of a model that numbers the rows of a sequence, or states which of them it takes.
    fn sequence_functions(&self) -> String {
        let (name, features) = (self.name, self.model.feature_count());
        let (row, missing) = self.row();
        let place = self.model.position().map(|position| usize::from(position.feature));
        let value = if row == "float" { "palpate_f32_key(*row++)" } else { "*row++" };
        let value = match place {
            Some(place) => format!("i == {place} ? 0 : {value}"),
            None => value.into(),
        };
        let is_guarded = self.model.guard().is_some();
        let (seen, argument) = match is_guarded {
            true => (format!(", {name}_seen *seen"), "&seen->rows, seen->last"),
            false => (String::new(), "&rows, NULL"),
        };
        let mut text = String::new();
        if is_guarded {
            text += &format!(
                "/* Rows of a sequence so far, and the feature, counted from 1, for which the last row was refused, or 0. */\n\
                 typedef struct {{\n    uint32_t rows;\n    uint16_t refused;\n    palpate_last last[{features}];\n}} {name}_seen;\n\n"
            );
        }
        let number = if place.is_some() { ", whose number is counted here," } else { "" };
        let (begin, push, refused) = match is_guarded {
            true => (
                "    seen->rows = 0;\n    seen->refused = 0;\n",
                format!(
                    "    seen->refused = palpate_next_row(&{name}_opened_, {argument}, keys);\n    \
                         if (seen->refused != 0) {{\n        \
                         return state->verdict == PALPATE_UNDECIDED ? -4 : palpate_decided_(state);\n    }}\n"
                ),
                ", -4 if the model does not take the row, which adds nothing",
            ),
            false => ("", format!("    (void)palpate_next_row(&{name}_opened_, {argument}, keys);\n"), ""),
        };
        let rows = if is_guarded { "" } else { "    uint32_t rows = palpate_rows_(state);\n" };
        text + &format!(
            "/* Begins a sequence: nothing was added yet. {OWN} */\n\
             static inline void {name}_begin(palpate_recognizer *state{seen})\n{{\n    \
             palpate_start_(state, &{name}_opened_);\n{begin}}}\n\n\
             /* Adds a row of {measured} features{number} {missing} where one is missing: the index of the object that is recognized; -1 \
             while none is, -2 if none fits, -3 at the limit of steps{refused}. After a decision nothing changes until {name}_begin. \
             {OWN} */\n\
             static inline int {name}_push(palpate_recognizer *state{seen}, const {row} *row)\n{{\n    int32_t keys[{features}];\n\
             {rows}    int i;\n    for (i = 0; i < {features}; i++) {{\n        keys[i] = {value};\n    }}\n{push}    \
             (void)palpate_push_features(state, keys, {features});\n    return palpate_decided_(state);\n}}\n\n\
             /* The decision at the end, or without one the object with the most evidence; -1 if nothing was added. {OWN} */\n\
             static inline int {name}_end(const palpate_recognizer *state)\n{{\n    return palpate_ended_(state);\n}}\n\n",
            measured = self.model.measured_count(),
        )
    }
}

/// Statement about functions that write nothing but their results.
const SAFE: &str = "Any threads and interrupts may call it at once.";
/// Statement about functions with a state.
const OWN: &str = "Threads and interrupts may call it at once, each with a state of its own.";
