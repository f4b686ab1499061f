use crate::assert_says;
use crate::samples::{self, corners};
use palpate_simulator::error::Result;
use palpate_simulator::mesh::Mesh;
use palpate_simulator::mesh::file::parse;
use std::path::Path;

fn parse_text(text: &str) -> Result<(Mesh, Option<f64>)> {
    parse(text.as_bytes(), Path::new("cup.dae")).map(|contents| (contents.mesh, contents.millimeters))
}

fn complaint(text: &str) -> String {
    parse_text(text).unwrap_err().to_string()
}

/// One triangle in the geometry `g`, with this asset, or else z up, these other libraries and this scene.
fn triangle(asset: &str, libraries: &str, nodes: &str) -> String {
    format!(
        "<COLLADA><asset>{asset}<up_axis>Z_UP</up_axis></asset><library_geometries><geometry id=\"g\"><mesh>\n\
         <source id=\"s\"><float_array id=\"a\" count=\"9\">0 0 0 1 0 0 0 <!-- here --> 2 0</float_array>\n\
         <technique_common><accessor source=\"#a\" count=\"3\" stride=\"3\"/></technique_common></source>\n\
         <vertices id=\"v\"><input semantic=\"POSITION\" source=\"#s\"/></vertices>\n\
         <triangles count=\"1\"><input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/><p>0 1 2</p></triangles>\n\
         </mesh></geometry></library_geometries>\n{libraries}\n\
         <library_visual_scenes><visual_scene id=\"scene\">{nodes}</visual_scene></library_visual_scenes>\n\
         <scene><instance_visual_scene url=\"#scene\"/></scene></COLLADA>\n"
    )
}

const INSTANCE: &str = "<instance_geometry url=\"#g\"/>";

fn placed(asset: &str, libraries: &str, nodes: &str) -> Vec<[[f32; 3]; 3]> {
    corners(&parse_text(&triangle(asset, libraries, nodes)).unwrap().0)
}

#[test]
fn transforms_apply_in_their_order_and_outer_nodes_last() {
    let nodes = format!(
        "<node><translate>10 0 0</translate><rotate>0 0 1 90</rotate>\
         <node><scale>2 2 2</scale><translate>1 0 0</translate>{INSTANCE}</node></node>"
    );
    // Scaled by 2, after a step along x; turned, so that x becomes y and y becomes -x; moved.
    assert_eq!(placed("", "", &nodes), [[[10.0, 2.0, 0.0], [10.0, 4.0, 0.0], [6.0, 2.0, 0.0]]]);
    let matrix = format!("<node><matrix>0 -1 0 10  1 0 0 0  0 0 1 5  0 0 0 1</matrix>{INSTANCE}</node>");
    assert_eq!(placed("", "", &matrix), [[[10.0, 0.0, 5.0], [10.0, 1.0, 5.0], [8.0, 0.0, 5.0]]]);
}

#[test]
fn transforms_of_nodes_without_geometry_are_not_looked_at() {
    let odd = ["<lookat>1 2 3 0 0 0 0 0 1</lookat>", "<skew>1 1 0 0 0 1 0</skew>", "<matrix>1 2</matrix>"];
    let camera =
        |odd| format!("<node>{odd}<node>{odd}<instance_camera url=\"#c\"/></node></node><node>{INSTANCE}</node>");
    let library = |odd| format!("<library_nodes><node id=\"n\">{odd}</node></library_nodes>");
    for odd in odd {
        let nodes = camera(odd) + "<node><instance_node url=\"#n\"/></node>";
        assert_eq!(placed("", &library(odd), &nodes).len(), 1, "{odd}");
        let said = complaint(&triangle("", "", &format!("<node>{odd}<node>{INSTANCE}</node></node>")));
        assert!(said.starts_with("cup.dae:8: "), "{said}");
    }
}

#[test]
fn a_mirror_keeps_the_outside() {
    let mirrored = placed("", "", &format!("<node><scale>-1 1 1</scale>{INSTANCE}</node>"));
    assert_eq!(mirrored, [[[0.0, 0.0, 0.0], [0.0, 2.0, 0.0], [-1.0, 0.0, 0.0]]]);
}

#[test]
fn nodes_that_are_instances_are_placed_each_time_and_a_circle_is_refused() {
    let library =
        format!("<library_nodes><node id=\"n\"><translate>0 0 1</translate>{INSTANCE}</node></library_nodes>");
    let nodes =
        "<node><instance_node url=\"#n\"/><translate>0 0 1</translate></node><node><instance_node url=\"#n\"/></node>";
    let heights: Vec<f32> = placed("", &library, nodes).iter().map(|corners| corners[0][2]).collect();
    assert_eq!(heights, [2.0, 1.0]);
    let circle = "<node id=\"x\"><node id=\"y\"><instance_node url=\"#x\"/></node></node>";
    assert!(complaint(&triangle("", "", circle)).contains("in a circle"));
    // Each instance of the next twice: 2 to the power of 40 triangles.
    let library: String = (0..40)
        .map(|i| {
            format!("<node id=\"n{i}\"><instance_node url=\"#n{}\"/><instance_node url=\"#n{}\"/></node>", i + 1, i + 1)
        })
        .collect();
    let library = format!("<library_nodes>{library}<node id=\"n40\">{INSTANCE}</node></library_nodes>");
    let said = complaint(&triangle("", &library, "<node><instance_node url=\"#n0\"/></node>"));
    assert!(said.contains("far too many") || said.contains("would take more"), "{said}");
}

#[test]
fn a_hundred_thousand_nested_nodes_are_read() {
    let deep = format!("{}{INSTANCE}{}", "<node>".repeat(100_000), "</node>".repeat(100_000));
    assert_eq!(placed("", "", &deep), [[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]]);
}

#[test]
fn the_upward_axis_becomes_z_and_the_unit_is_stated() {
    let node = format!("<node>{INSTANCE}</node>");
    let read = |asset: &str| placed(asset, "", &node)[0];
    assert_eq!(read(""), [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]);
    assert_eq!(read("<up_axis>Z_UP</up_axis>"), read(""));
    assert_eq!(read("<up_axis> Y_UP\n</up_axis>"), [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 2.0]]);
    assert_eq!(read("<up_axis>X_UP</up_axis>"), [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [-2.0, 0.0, 0.0]]);
    let unstated = triangle("", "", &node).replace("<up_axis>Z_UP</up_axis>", "");
    let contents = parse(unstated.as_bytes(), Path::new("cup.dae")).unwrap();
    assert_eq!(corners(&contents.mesh)[0], read("<up_axis>Y_UP</up_axis>"));
    assert_eq!(contents.notes, ["cup.dae states no upward axis: y is up, by the standard of COLLADA"]);
    let unit = |asset: &str| parse_text(&triangle(asset, "", &node)).unwrap().1;
    assert_eq!([unit(""), unit("<unit meter=\"0.01\"/>"), unit("<unit/>")], [None, Some(10.0), Some(1000.0)]);
    for (asset, expected) in
        [("<unit meter=\"0\"/>", "its unit is \"0\" meters"), ("<up_axis>W_UP</up_axis>", "\"W_UP\" is no")]
    {
        assert!(complaint(&triangle(asset, "", &node)).contains(expected));
    }
}

#[test]
fn a_file_without_a_scene_gives_each_geometry_once() {
    let text = triangle("", "", "")
        .replace("<library_visual_scenes>", "<extra>")
        .replace("</library_visual_scenes>", "</extra>");
    let text = text.replace("<scene><instance_visual_scene url=\"#scene\"/></scene>", "");
    assert_eq!(parse_text(&text).unwrap().0.triangles.len(), 1);
}

#[test]
fn names_in_latin_1_are_read_where_the_file_says_so() {
    let text = triangle("", "", &format!("<node name=\"\u{e9}\">{INSTANCE}</node>"));
    let latin: Vec<u8> = text.chars().map(|letter| letter as u8).collect();
    let with = |declaration: &str| [declaration.as_bytes(), &latin].concat();
    assert!(parse(&with("<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?>"), Path::new("cup.dae")).is_ok());
    assert_says(parse(&latin, Path::new("cup.dae")).unwrap_err(), &["cup.dae: byte ", "not text in UTF-8"]);
}

#[test]
fn what_is_not_read_or_damaged_is_refused_by_name_with_its_line() {
    let good = triangle("", "", &format!("<node>{INSTANCE}</node>"));
    let controller =
        "<library_controllers><controller id=\"c\"><skin source=\"#g\"/></controller></library_controllers>";
    let skinned = triangle("", controller, "<node><instance_controller url=\"#c\"/></node>");
    assert!(complaint(&skinned).contains("a skin (<controller>), which bends the mesh, is not read. Apply it"));
    assert!(complaint(&skinned.replace("skin", "morph")).contains("a morph (<controller>)"));
    for (from, to, expected) in [
        ("<node>", "<node><skew>1 1 0 0 0 1 0</skew>", "the transform <skew> is not read"),
        ("<node>", "<node><lookat>1</lookat>", "the transform <lookat> is not read"),
        ("<node>", "<node><rotate>0 0 0 30</rotate>", "a rotation about no axis"),
        ("<node>", "<node><scale>1 1</scale>", "cup.dae:8: the COLLADA file is damaged: <scale> has 2 numbers"),
        ("<node>", "<node><matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1</matrix>", "last row is not 0 0 0 1"),
        ("url=\"#g\"", "url=\"other.dae#g\"", "in another file"),
        ("url=\"#g\"", "url=\"#h\"", "there is no <geometry> with the id \"#h\""),
        ("url=\"#g\"", "", "<instance_geometry> has no url"),
        ("<mesh>", "<spline/><mesh>", "the geometry <spline> is not read"),
        (
            "count=\"9\"",
            "count=\"8\"",
            "cup.dae:2: the COLLADA file is damaged: <float_array> states 8 numbers, but has 9",
        ),
        ("0 1 0", "0 x 0", "cup.dae:2: \"x\" is not a number"),
        ("0 1 0", "0 1e39 0", "cup.dae:2: the COLLADA file is damaged: the number \"1e39\" is not finite"),
        ("count=\"3\" stride", "count=\"4\" stride", "4 positions in steps of 3 need more than 9 numbers"),
        ("stride=\"3\"", "stride=\"1\"", "positions in steps of 1"),
        ("stride=\"3\"", "stride=\"18446744073709551615\"", "need more than 9 numbers"),
        ("0 1 2</p>", "0 1 3</p>", "cup.dae:5: vertex 3 of a face is missing"),
        ("0 1 2</p>", "0 1</p>", "do not make whole faces"),
        ("0 1 2</p>", "0 1 -2</p>", "cup.dae:5: \"-2\" is not a number"),
        ("<triangles count=\"1\"", "<triangles count=\"2\"", "<triangles> states 2 faces, but has 1"),
        ("<p>0 1 2</p>", "", "without the indices that it counts"),
        ("<p>0 1 2</p>", "<ph><p>0 1 2</p><h>0 1 2</h></ph>", "a polygon with holes (<ph>) is not read"),
        ("offset=\"0\"", "offset=\"4000000000\"", "is too large"),
        ("semantic=\"VERTEX\"", "semantic=\"NORMAL\"", "without an input of vertices"),
        ("</COLLADA>", "", "cup.dae:"),
        ("<COLLADA>", "<!DOCTYPE x [<!ENTITY a \"b\">]><COLLADA>", "a document type declaration"),
    ] {
        assert!(good.contains(from), "{from}");
        let said = complaint(&good.replacen(from, to, 1));
        assert!(said.starts_with("cup.dae") && said.contains(expected), "{to}: {said}");
    }
}

#[test]
fn polygons_are_cut_as_those_of_an_obj_file() {
    // An L, starting next to its inner corner.
    let places = [[2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0], [0, 0, 0], [2, 0, 0]];
    let numbers = places.iter().flatten().map(|x: &i32| format!("{x} ")).collect::<String>();
    let lines: String = places.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
    let expected =
        palpate_simulator::mesh::obj::parse((lines + "f 1 2 3 4 5 6\n").as_bytes(), Path::new("l.obj")).unwrap();
    let good = triangle("", "", &format!("<node>{INSTANCE}</node>"))
        .replace("0 0 0 1 0 0 0 <!-- here --> 2 0", &numbers)
        .replace("count=\"9\"", "count=\"18\"")
        .replace("count=\"3\" stride", "count=\"6\" stride");
    for (kind, inside) in [("polylist", "<vcount>6</vcount><p>0 1 2 3 4 5</p>"), ("polygons", "<p>0 1 2 3 4 5</p>")] {
        let text = good.replace("triangles", kind).replace("<p>0 1 2</p>", inside);
        assert_eq!(corners(&parse_text(&text).unwrap().0), corners(&expected), "{kind}");
    }
    let fan = good.replace("triangles", "trifans").replace("<p>0 1 2</p>", "<p>4 5 0</p><p>4 0 1 2</p>");
    assert_eq!(parse_text(&fan).unwrap().0.triangles, [[4, 5, 0], [4, 0, 1], [4, 1, 2]]);
    let strip = good.replace("triangles", "tristrips").replace("<p>0 1 2</p>", "<p>0 1 2 3</p>");
    assert_eq!(parse_text(&strip).unwrap().0.triangles, [[0, 1, 2], [2, 1, 3]]);
    assert!(samples::collada(&Mesh::globe(3)).contains("polylist"));
}
