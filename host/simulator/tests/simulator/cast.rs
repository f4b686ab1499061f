use palpate_simulator::error::Result;
use palpate_simulator::mesh::Mesh;
use palpate_simulator::probe::Scene;
use palpate_simulator::probe::cast::{Agreement, Line, agreement, annotate, read, times};

fn lines(text: &str) -> Result<Vec<Line>> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("casts.csv");
    std::fs::write(&path, text).unwrap();
    read(&path)
}

#[test]
fn lines_come_back_with_their_time_appended() {
    let vertices = vec![[0.0, -5.0, -5.0], [0.0, 5.0, -5.0], [0.0, 0.0, 5.0]];
    let scene = Scene::as_is(&Mesh { vertices, triangles: vec![[0, 1, 2]] }).unwrap();
    let lines =
        lines("# casts\n\na,-4,0,0,2,0,0,1.75\na,-4,0,0,-2,0,0\r\nb,1,0,0,-1,0,0,miss\nb,0,9,0,0,0,0,0\n").unwrap();
    let times = times(&scene, &lines, 0.5);
    let text = annotate(&lines, &times);
    let expected =
        "# casts\n\na,-4,0,0,2,0,0,1.75,1.75\na,-4,0,0,-2,0,0,miss\nb,1,0,0,-1,0,0,miss,0.5\nb,0,9,0,0,0,0,0,miss\n";
    assert_eq!(text, expected);
    let agreement = agreement(&lines, &times);
    let set = |set: &str, casts, missed, false_contacts| Agreement {
        set: set.into(),
        casts,
        missed,
        false_contacts,
        largest_error: 0.0,
    };
    assert_eq!(agreement, [set("a", 1, 0, 0), set("b", 2, 1, 1)]);
}

#[test]
fn wrong_lines_are_named() {
    for (text, what) in [
        ("a,0,0,0,1,0\n", "casts.csv:1: 6 fields"),
        ("# x\na,0,0,0,1,0,x\n", "casts.csv:2: \"x\" is not a finite number"),
        ("a,0,0,0,1,0,1e39\n", "\"1e39\" is not a finite number"),
        ("a,0,0,0,1,0,0,-1\n", "\"-1\" is neither a time nor `miss`"),
    ] {
        let error = lines(text).unwrap_err().to_string();
        assert!(error.contains(what) && error.ends_with("Give set,ox,oy,oz,dx,dy,dz and, if known, t."), "{error}");
    }
}
