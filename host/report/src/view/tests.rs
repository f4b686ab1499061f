use super::*;
use crate::small::{BOWL, contrast};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use palpate::mesh::Mesh;
use std::collections::HashMap;

fn cube() -> Mesh {
    let vertices = (0..8_u8).map(|i| [i & 1, i >> 1 & 1, i >> 2].map(f32::from)).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    Mesh { vertices, triangles: quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect() }
}

/// A wavy square of 2n² triangles.
fn waves(n: u32) -> Mesh {
    let place = |i: u32| i as f32 / n as f32;
    let vertices = (0..=n)
        .flat_map(|y| (0..=n).map(move |x| (x, y)))
        .map(|(x, y)| [place(x), place(y), 0.1 * libm::sinf(20.0 * place(x)) * libm::sinf(15.0 * place(y))])
        .collect();
    let at = |x, y| y * (n + 1) + x;
    let triangles = (0..n)
        .flat_map(|y| (0..n).map(move |x| (x, y)))
        .flat_map(|(x, y)| {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    Mesh { vertices, triangles }
}

/// The data that the page's script reads.
fn data(page: &str) -> serde_json::Value {
    let start = page.find(r#"type="application/json">"#).unwrap() + 24;
    let end = start + page[start..].find("</script>").unwrap();
    serde_json::from_str(&page[start..end]).unwrap()
}

#[test]
fn a_page_refers_to_nothing_outside_itself_and_its_buttons_and_headings_have_names() {
    let page = page(&BOWL, &Settings::default()).unwrap();
    let own = page.replace(scene::LIBRARY, "");
    for part in [" src=", "@import", "url(", "<link rel=\"stylesheet\"", "fetch(\"http", "importScripts"] {
        assert!(!own.contains(part), "the page holds {part}");
    }
    assert!(page.contains("default-src 'none'") && page.contains("aria-label=\"Show approach 1\""));
    for empty in ["<button type=\"button\"></button>", "<th scope=\"col\"></th>", "<th></th>", "<th>"] {
        assert!(!page.contains(empty), "{empty}");
    }
}

#[test]
fn a_page_has_the_touches_that_were_asked_for_and_a_dozen_misses() {
    let settings = Settings { touches: 7, ..Settings::default() };
    let page = page(&BOWL, &settings).unwrap();
    let data = data(&page);
    let approaches = data["approaches"].as_array().unwrap();
    let full = |approach: &&serde_json::Value| approach["distances"].as_array().unwrap().iter().all(|d| d.is_number());
    assert_eq!((approaches.len(), approaches.iter().filter(full).count()), (19, 7));
    assert_eq!(page.matches("<tr data-approach").count(), 19);
}

#[test]
fn a_page_of_an_object_on_a_table_shows_its_placements_and_approaches_from_above_that_end_at_the_table() {
    let floating = page(&BOWL, &Settings::default()).unwrap();
    assert_eq!(data(&floating)["table"], false);
    assert!(!floating.contains("aria-label=\"Placements\""));
    let shown = page(&BOWL, &Settings { cone: Some(40.0), ..Settings::default() }).unwrap();
    let data = data(&shown);
    assert_eq!(data["table"], true);
    let found = placements::of_object(&BOWL).unwrap().remove(0);
    assert_eq!(shown.matches("points up\"").count(), found.placements.len());
    for placement in found.placements.iter().chain(&found.left_out) {
        assert!(shown.contains(&captioned(placement)), "{}", placement.name);
    }
    let lowest = data["low"][2].as_f64().unwrap();
    let lines = data["lines"].as_array().unwrap();
    assert!(!lines.is_empty());
    for line in lines {
        let [start, end] =
            ["start", "end"].map(|end| DVec3::from_array([0, 1, 2].map(|axis| line[end][axis].as_f64().unwrap())));
        assert!(end.z >= lowest, "{line} goes through the table at {lowest}");
        let down = -(end - start).normalize().z;
        assert!(down >= 40_f64.to_radians().cos() - 1e-9, "{line}");
    }
}

#[test]
fn the_shown_mesh_is_as_large_as_the_scene_and_its_name_cannot_break_out_of_the_page() {
    let object = Object::new("</script><script>alert(1)</script>", cube());
    let page = page(&object, &Settings { length: 4.0, ..Settings::default() }).unwrap();
    assert!(!page.contains("<script>alert"));
    let data = data(&page);
    assert_eq!(data["low"], serde_json::json!([-2.0, -2.0, -2.0]));
    assert_eq!(data["origin"], serde_json::json!([-2.0, -2.0, -2.0]));
    assert!((data["step"].as_f64().unwrap() * 65535.0 - 4.0).abs() < 1e-12);
    let steps = STANDARD.decode(data["positions"].as_str().unwrap()).unwrap();
    assert_eq!(steps.len(), 8 * 6);
    assert_eq!((steps.iter().min(), steps.iter().max()), (Some(&0), Some(&255)));
}

#[test]
fn a_large_mesh_and_a_soup_of_its_triangles_make_pages_below_six_megabytes() {
    let smooth = waves(388);
    assert!(smooth.triangles.len() > 300_000);
    // The same as separate triangles, each shrunk so that none shares a corner with another.
    let vertices: Vec<[f32; 3]> = smooth
        .triangles
        .iter()
        .flat_map(|triangle| {
            let corners = triangle.map(|i| glam::Vec3::from(smooth.vertices[i as usize]));
            let middle = corners.iter().sum::<glam::Vec3>() / 3.0;
            corners.map(|corner| corner.lerp(middle, 0.1).to_array())
        })
        .collect();
    let soup =
        Mesh { triangles: (0..vertices.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(), vertices };
    for (name, mesh) in [("smooth", smooth), ("soup", soup)] {
        let page = page(&Object::new(name, mesh), &Settings::default()).unwrap();
        assert!(page.len() < 6_000_000, "{name}: {} bytes", page.len());
        let count = STANDARD.decode(data(&page)["indices"].as_str().unwrap()).unwrap().len();
        assert!(count > 3 * 2 * scene::MOST_TRIANGLES / 3, "{name}: only {count} bytes of indices are left");
        assert!(page.contains("simplified to"), "{name}");
    }
}

#[test]
fn numbers_have_three_digits() {
    assert_eq!(
        [three_digits(16.0), three_digits(0.15), three_digits(1234.5), three_digits(0.0), three_digits(2e-9)],
        ["16.0", "0.150", "1234", "0.00e0", "2.00e-9"]
    );
}

/// The custom properties of the page's styles, in light and in dark.
fn colors(style: &str) -> [HashMap<String, [f64; 3]>; 2] {
    let of = |block: &str| -> HashMap<String, [f64; 3]> {
        let properties = block.split('}').next().unwrap().split('{').nth(1).unwrap().split(';');
        let property = |text: &str| {
            let (name, color) = text.trim().strip_prefix("--")?.split_once(": #")?;
            let digit = |i: usize| f64::from(u8::from_str_radix(&color[i..=i], 16).unwrap());
            let channel =
                |i: usize| if color.len() == 3 { 17.0 * digit(i) } else { 16.0 * digit(2 * i) + digit(2 * i + 1) };
            Some((name.to_string(), [0, 1, 2].map(channel)))
        };
        properties.filter_map(property).collect()
    };
    let (light, dark) = style.split_once("prefers-color-scheme: dark").unwrap();
    [of(&light[light.find(":root").unwrap()..]), of(&dark[dark.find(":root").unwrap()..])]
}

#[test]
fn text_on_the_pages_has_a_contrast_of_at_least_four_and_a_half() {
    let view = include_str!("page.css");
    // The fingers' colors are for dots and underlines, not for text.
    assert!(!view.contains(" color: var(--first)") && !view.contains(" color: var(--middle)"));
    let texts = [("ink", "ground"), ("ink", "shade"), ("soft", "ground")];
    for (style, more) in [
        (view, [("warning", "ground"), ("on-first", "first")]),
        (crate::page::document::STYLE, [("soft", "shade"), ("link", "ground")]),
    ] {
        for colors in colors(style) {
            for (text, ground) in texts.into_iter().chain(more) {
                let contrast = contrast(colors[text], colors[ground]);
                assert!(contrast >= 4.5, "{text} on {ground}: {contrast}");
            }
        }
    }
    for colors in colors(view) {
        for dot in ["first", "middle", "last", "missed", "back"] {
            assert!(contrast(colors[dot], colors["ground"]) >= 3.0, "{dot} on the ground");
        }
    }
}
