use crate::{command, stderr, stdout};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// A ball of points with normals, 5 in radius.
fn ball(directory: &Path, name: &str) -> PathBuf {
    let mut text = String::new();
    for index in 0..3000 {
        let z = 1.0 - (2.0 * f64::from(index) + 1.0) / 3000.0;
        let (radius, angle) = ((1.0 - z * z).sqrt(), 2.399_963 * f64::from(index));
        let [x, y] = [radius * angle.cos(), radius * angle.sin()];
        writeln!(text, "{} {} {} {x} {y} {z}", 5.0 * x, 5.0 * y, 5.0 * z).unwrap();
    }
    let path = directory.join(name);
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn a_page_shows_the_points_of_a_scan_and_their_surface_and_stderr_says_what_was_made_of_them() {
    let directory = tempfile::tempdir().unwrap();
    let (scan, page) = (ball(directory.path(), "ball.xyz"), directory.path().join("ball.html"));
    let output = command(["view"]).arg(&scan).arg("-o").arg(&page).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && said.contains("through 3000 points"), "{said}");
    let text = std::fs::read_to_string(&page).unwrap();
    assert!(text.contains("<title>ball") && text.contains("<dt>Right side out</dt><dd class=\"\">yes</dd>"));
}

#[test]
fn scans_and_meshes_are_captured_together_and_the_same_seed_gives_the_same_touches() {
    let directory = tempfile::tempdir().unwrap();
    let objects = directory.path().join("objects");
    std::fs::create_dir(&objects).unwrap();
    ball(&objects, "ball.xyz");
    crate::globe(&objects, "globe", 8);
    let captured = |name: &str| {
        let data = directory.path().join(name);
        stdout(command(["capture"]).arg(&objects).arg("-o").arg(&data).args(["--touches", "200"]).output().unwrap());
        ["ball.txt", "globe.txt"].map(|file| std::fs::read(data.join(file)).unwrap())
    };
    let first = captured("first");
    assert!(first.iter().all(|touches| touches.iter().filter(|byte| **byte == b'\n').count() == 200));
    assert_eq!(captured("second"), first);
}

#[test]
fn the_surface_of_a_scan_is_written_as_a_closed_mesh() {
    let directory = tempfile::tempdir().unwrap();
    let scan = ball(directory.path(), "ball.xyz");
    let said = stdout(command(["data", "objects"]).arg(&scan).arg("-o").arg(directory.path()).output().unwrap());
    let mesh = palpate::mesh::obj::read(&directory.path().join("ball.obj")).unwrap();
    assert!(said.contains(&format!("{} triangles", mesh.triangles.len())), "{said}");
    let facts = palpate::mesh::facts::Facts::of(&mesh);
    assert!(facts.is_right_side_out() && facts.open_edges == 0);
    let farthest = mesh.vertices.iter().map(|[x, y, z]| (x.hypot(*y).hypot(*z) - 5.0).abs()).fold(0.0, f32::max);
    assert!(farthest < 0.15, "{farthest}");
}

#[test]
fn points_that_do_not_say_which_side_is_outside_and_bad_lines_are_refused_with_what_to_do() {
    let directory = tempfile::tempdir().unwrap();
    let refused = |name: &str, text: &str, expected: &[&str]| {
        let (scan, page) = (directory.path().join(name), directory.path().join("page.html"));
        std::fs::write(&scan, text).unwrap();
        let error = stderr(command(["view"]).arg(&scan).arg("-o").arg(&page).output().unwrap(), 1);
        assert!(error.contains(name) && expected.iter().all(|words| error.contains(words)), "{error}");
        assert!(!page.exists());
    };
    let bare: String = (0..400).map(|index| format!("{index} {} {}\n", index % 7, index % 5)).collect();
    refused("bare.xyz", &bare, &["normal"]);
    refused("word.xyz", "# a ball\n0 0 5 0 0 1\n0 0 five 0 0 1\n", &["word.xyz:3", "five"]);
    refused("cut.pcd", "VERSION 0.7\nFIELDS x y z normal_x\n", &["cut.pcd"]);
    refused("none.xyz", "", &["point"]);
}
