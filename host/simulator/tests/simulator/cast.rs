#[allow(dead_code, reason = "it has a main function")]
#[path = "../../examples/cast.rs"]
mod example;

/// Output of the example for a triangle across the x axis and these casts of spheres with a radius of .5.
fn written(casts: &str) -> Result<String, String> {
    let directory = tempfile::tempdir().unwrap();
    let [mesh, file] = ["mesh.obj", "casts.csv"].map(|name| directory.path().join(name).display().to_string());
    std::fs::write(&mesh, "v 0 -5 -5\nv 0 5 -5\nv 0 0 5\nf 1 2 3\n").unwrap();
    std::fs::write(&file, casts).unwrap();
    let mut out = Vec::new();
    let words = [mesh, file, "--as-is".into(), "--radius".into(), "0.5".into()];
    example::run(words.into_iter(), &mut out).map_err(|error| error.to_string())?;
    Ok(String::from_utf8(out).unwrap())
}

#[test]
fn lines_come_back_with_their_time_appended() {
    let casts = "# casts\n\na,-4,0,0,2,0,0,1.75\na,-4,0,0,-2,0,0\r\nb,1,0,0,-1,0,0,miss\nb,0,9,0,0,0,0,0\n";
    let expected =
        "# casts\n\na,-4,0,0,2,0,0,1.75,1.75\na,-4,0,0,-2,0,0,miss\nb,1,0,0,-1,0,0,miss,0.5\nb,0,9,0,0,0,0,0,miss\n";
    assert_eq!(written(casts), Ok(expected.into()));
}

#[test]
fn wrong_lines_and_options_are_named() {
    for (casts, place) in [("a,0,0,0,1,0\n", ":1: "), ("# x\na,0,0,0,1,0,x\n", ":2: "), ("a,0,0,0,1,0,1e39\n", ":1: ")]
    {
        let error = written(casts).unwrap_err();
        assert!(error.ends_with(&format!("casts.csv{place}give set,ox,oy,oz,dx,dy,dz and, if known, t")), "{error}");
    }
    for (words, expected) in [("a.obj", "give MESH CASTS"), ("a.obj b.csv --radius 0", "--radius needs a number")] {
        let error = example::run(words.split(' ').map(String::from), Vec::new()).unwrap_err().to_string();
        assert!(error.starts_with(expected), "{error}");
    }
}
