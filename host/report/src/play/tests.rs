use super::*;
use crate::small::model;
use palpate::mesh::Mesh;
use palpate::probe::scene::Scene;

/// The sections of a WebAssembly module: each one's number and content.
fn sections(module: &[u8]) -> Vec<(u8, &[u8])> {
    let mut rest = module.strip_prefix(b"\0asm\x01\0\0\0").expect("a module of version 1");
    let mut sections = Vec::new();
    while let Some((&number, tail)) = rest.split_first() {
        // LEB128.
        let end = tail.iter().position(|byte| byte & 0x80 == 0).unwrap() + 1;
        let length = (0..end).map(|at| usize::from(tail[at] & 0x7f) << (7 * at)).sum();
        let (content, after) = tail[end..].split_at(length);
        sections.push((number, content));
        rest = after;
    }
    sections
}

#[test]
fn the_compiled_parts_of_pages_import_nothing_name_no_path_and_are_small() {
    for (module, most) in [(WASM, 400_000), (crate::watch::WASM, 40_000)] {
        let sections = sections(module);
        assert!(sections.iter().any(|(number, _)| *number == 10), "it has code");
        assert!(!sections.iter().any(|(number, _)| *number == 2), "it has a section of imports");
        let compressed = miniz_oxide::deflate::compress_to_vec_zlib(module, 9).len();
        assert!(compressed <= most, "{compressed} bytes");
        let text = String::from_utf8_lossy(module);
        for path in ["/home/", "/root/", "/tmp/", "/usr/", "C:\\"] {
            assert!(!text.contains(path), "{path}");
        }
    }
}

fn object(name: &str, rings: u32, height: f32) -> Object {
    Object::new(name, Mesh::globe(rings).stretched([1.0, 1.0, height]))
}

/// One nat for the first of two objects below a curvature of 9 ms, one for the second above.
fn contender(names: [&str; 2]) -> Contender {
    Contender::new(model(names)).unwrap()
}

fn settings() -> Settings {
    Settings { origin: Origin::default(), noise: Noise::switch(), command: "palpate play".into() }
}

#[test]
fn a_page_holds_everything_itself_and_names_cannot_break_out_of_it() {
    let objects = [object("</script><script>alert(1)</script>", 8, 1.0), object("disc", 8, 0.1)];
    let page = page(&objects, &[contender(["disc", "<b>"])], &settings()).unwrap();
    assert!(!page.contains("<script>alert") && !page.contains("<b>"));
    let own = page.replace(scene::LIBRARY, "");
    for part in ["http:", "https:", "url(", "@import", "src=\"/", "fetch(", "import("] {
        assert!(!own.contains(part), "{part}");
    }
    assert!(own.contains("'wasm-unsafe-eval'") && own.contains("curvature, full touches"));
    // Only one model: nothing to choose, and no plan.
    assert!(!own.contains("id=\"model\"") && !own.contains("id=\"planned\""));
}

#[test]
fn a_page_says_how_large_its_models_are_what_they_need_and_where_random_approaches_aim() {
    let objects = [object("disc", 8, 0.1), object("globe", 8, 1.0)];
    let one = [contender(["disc", "globe"])];
    let bytes = count(one[0].model.bytes().len());
    let page_of = |contenders: &[Contender], aim| {
        let origin = Origin { aim, ..Origin::default() };
        page(&objects, contenders, &Settings { origin, ..settings() }).unwrap()
    };
    let alone = page_of(&one, Aim::Box);
    let said = format!("From these times alone a model of {bytes} bytes distinguishes 2 objects.");
    assert!(alone.contains(&said) && alone.contains("at any point of the bounding box."), "{said}");
    assert!(!alone.contains("kilobytes") && !alone.contains("A planned approach"));
    let two = [one[0].clone(), one[0].clone()];
    let both = page_of(&two, Aim::Mass);
    assert!(both.contains(&format!("models of {bytes} to {bytes} bytes distinguish 2 objects.")));
    assert!(both.contains("about the surface's center of mass"));
}

#[test]
fn a_page_of_ten_large_objects_stays_below_three_megabytes_and_says_what_it_simplified() {
    // Rough surfaces: smooth ones are packed too well to be simplified.
    let rough = |i: u32| {
        let mut mesh = Mesh::globe(180 + i).stretched([1.0, 1.0, 0.1 * (i + 1) as f32]);
        for (index, vertex) in mesh.vertices.iter_mut().enumerate() {
            let scale = 1.0 + 3e-6 * (7_919 * index % 10_007) as f32;
            *vertex = vertex.map(|coordinate| coordinate * scale);
        }
        Object::new(format!("object{i}"), mesh)
    };
    let objects: Vec<Object> = (0..10).map(rough).collect();
    let page = page(&objects, &[contender(["object0", "object1"])], &settings()).unwrap();
    assert!(page.len() < 3_000_000, "{} bytes", page.len());
    let last = count(objects[9].mesh().triangles.len());
    let (before, _) = page.split_once(&format!(" of {last} triangles)")).unwrap();
    let left: usize = before.rsplit('(').next().unwrap().replace(',', "").parse().unwrap();
    assert!((5_000..objects[9].mesh().triangles.len()).contains(&left), "{left} of {last}");
}

#[test]
fn the_household_model_is_the_one_that_the_repository_ships() {
    assert_eq!(Contender::household().unwrap().name, "curvature, every contact");
    let shipped = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/household.palpate");
    assert!(std::fs::read(shipped).unwrap() == HOUSEHOLD, "copy {shipped} into assets/play");
}

#[test]
fn a_small_object_is_touched_as_it_is_but_for_a_rounding_of_its_corners() {
    let objects = [object("globe", 20, 1.0)];
    let [surface] = &surfaces(&objects, &Origin::default()).unwrap()[..] else { panic!() };
    assert_eq!((surface.triangles, surface.of, surface.length), (1_520, 1_520, 10.0));
    let scene = |mesh: &Mesh| Scene::new(mesh, 10.0).unwrap();
    let (own, page) = (scene(objects[0].mesh()), scene(&surface.mesh()));
    let origin = Origin { approaches: true, ..Origin::default() };
    let touched = |scene: Scene| palpate::capture::touches(&[scene], "globe", &origin, 0..300).unwrap();
    for (own, page) in touched(own).touches().iter().zip(touched(page).touches()) {
        assert_eq!(own.pattern(), page.pattern());
        let times = own.times().into_iter().zip(page.times());
        for (own, page) in times.filter_map(|(own, page)| Some((own.micros()?, page.micros()?))) {
            // A step is 15 µs of way; on a slope a contact moves by a few of them.
            assert!(own.abs_diff(page) < 200, "{own} {page}");
        }
    }
}

#[test]
fn models_of_one_name_are_told_apart_by_their_files() {
    let names = |files: &[&str]| -> Vec<String> {
        let mut contenders: Vec<Contender> = files.iter().map(|_| contender(["a", "b"])).collect();
        distinguish(&mut contenders, &files.iter().map(PathBuf::from).collect::<Vec<_>>());
        contenders.into_iter().map(|contender| contender.name.replace("curvature, full touches", "~")).collect()
    };
    assert_eq!(names(&["a.palpate"]), ["~"]);
    assert_eq!(names(&["small.palpate", "dir/sure.palpate"]), ["~ (small)", "~ (sure)"]);
    assert_eq!(names(&["x/m.palpate", "y/m.palpate", "n.palpate"]), ["~ (x/m.palpate)", "~ (y/m.palpate)", "~ (n)"]);
    assert_eq!(names(&["m.palpate", "m.palpate"]), ["~ (m.palpate, 1)", "~ (m.palpate, 2)"]);
}
