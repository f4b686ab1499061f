use crate::mesh::Mesh;
use crate::mesh::facts::Facts;
use crate::mesh::file;
use crate::random::{self, Purpose};
use glam::{DVec3, Vec3};
use rand_distr::{Distribution, Normal, UnitSphere};
use std::path::Path;

/// Points of a sphere of 50 about the origin, with its normals: 4,000, with Gaussian noise of so much along each axis.
fn sphere(noise: f64, is_kept: impl Fn(DVec3) -> bool) -> Vec<(DVec3, DVec3)> {
    let mut rng = random::generator(1, Purpose::View, "sphere", 0);
    let normal = Normal::new(0.0, noise).unwrap();
    let directions = (0..4_000).map(|_| UnitSphere.sample(&mut rng)).collect::<Vec<[f64; 3]>>();
    let mut moved = |direction: DVec3| {
        let [x, y, z] = std::array::from_fn(|_| normal.sample(&mut rng));
        (50.0 * direction + DVec3::new(x, y, z), direction)
    };
    directions.into_iter().map(DVec3::from).filter(|&direction| is_kept(direction)).map(&mut moved).collect()
}

fn xyz(points: &[(DVec3, DVec3)]) -> String {
    points.iter().map(|(p, n)| format!("{} {} {} {} {} {}\n", p.x, p.y, p.z, n.x, n.y, n.z)).collect()
}

fn read(bytes: &[u8], name: &str) -> file::Contents {
    file::parse(bytes, Path::new(name)).unwrap()
}

fn refusal(bytes: &[u8], name: &str) -> String {
    file::parse(bytes, Path::new(name)).unwrap_err().to_string()
}

/// The largest and the mean distance of vertices from the sphere.
fn errors(mesh: &Mesh) -> [f64; 2] {
    let away = |vertex: &[f32; 3]| (f64::from(Vec3::from(*vertex).length()) - 50.0).abs();
    let all: Vec<f64> = mesh.vertices.iter().map(away).collect();
    [all.iter().copied().fold(0.0, f64::max), all.iter().sum::<f64>() / all.len() as f64]
}

fn assert_sound(mesh: &Mesh) {
    let facts = Facts::of(mesh);
    assert!(facts.is_right_side_out(), "{:?}", facts.complaints(None));
    assert_eq!(facts.parts.len(), 1);
}

#[test]
fn a_spheres_cloud_becomes_a_closed_surface_within_a_thirtieth_of_its_radius() {
    let contents = read(xyz(&sphere(0.0, |_| true)).as_bytes(), "sphere.xyz");
    assert_sound(&contents.mesh);
    let [largest, mean] = errors(&contents.mesh);
    assert!(largest < 50.0 / 30.0 && mean < 0.6, "{largest} {mean}");
    assert_eq!(contents.points.len(), 4_000);
    assert!(contents.notes.iter().any(|note| note.contains("no hole is closed")), "{:?}", contents.notes);
}

#[test]
fn noise_is_smoothed_and_its_size_is_said() {
    let contents = read(xyz(&sphere(1.0, |_| true)).as_bytes(), "sphere.xyz");
    assert_sound(&contents.mesh);
    let [largest, mean] = errors(&contents.mesh);
    assert!(largest < 3.0 && mean < 0.8, "{largest} {mean}");
    let note = contents.notes.iter().find_map(|note| note.split_once("a noise of ")).unwrap().1;
    assert!((0.8..1.2).contains(&note.parse::<f64>().unwrap()), "{note}");
}

#[test]
fn a_hole_is_closed_and_its_area_is_said() {
    // A cap of 8 % of the sphere: 2,513 square units.
    let contents = read(xyz(&sphere(0.2, |direction| direction.z > -0.84)).as_bytes(), "sphere.xyz");
    assert_sound(&contents.mesh);
    let note = contents.notes.iter().find(|note| note.contains("hole")).unwrap();
    let share: f64 = note.split(' ').rev().nth(4).unwrap().parse().unwrap();
    assert!(note.contains("one hole is closed") && (3.0..9.0).contains(&share), "{note}");
}

#[test]
fn points_far_from_all_others_are_left_out_and_counted() {
    let text = xyz(&sphere(0.2, |_| true)) + "300 0 0 1 0 0\n";
    let contents = read(text.as_bytes(), "sphere.xyz");
    assert_sound(&contents.mesh);
    assert!(contents.mesh.bounds()[1].x < 55.0);
    assert!(contents.notes[0].contains("1 of 4001 points lie apart"), "{:?}", contents.notes);
}

#[test]
fn hard_clouds_give_a_closed_surface_that_can_be_touched_or_an_error() {
    let ball = sphere(0.0, |_| true);
    let moved = |by: &dyn Fn(DVec3) -> (DVec3, DVec3)| ball.iter().map(|&(place, _)| by(place)).collect::<Vec<_>>();
    let alternating = |place: DVec3| if place.x.to_bits().is_multiple_of(2) { place } else { -place };
    let far = 1_000.0 * DVec3::X;
    let clouds = [
        ("a plane of no thickness", moved(&|p| (DVec3::new(p.x, p.y, 0.0), DVec3::Z))),
        ("a plane with both sides", moved(&|p| (DVec3::new(p.x, p.y, 0.0), p.z.signum() * DVec3::Z))),
        ("a sheet thinner than a cell", moved(&|p| (DVec3::new(p.x, p.y, 1e-3 * p.z), p.z.signum() * DVec3::Z))),
        ("a line", moved(&|p| (DVec3::new(p.x, 0.0, 0.0), DVec3::Z))),
        ("a needle", moved(&|p| (DVec3::new(1e3 * p.x, p.y, p.z), DVec3::new(0.0, p.y, p.z)))),
        ("one point many times", moved(&|_| (DVec3::ONE, DVec3::Z))),
        ("each point twice", ball.iter().chain(&ball).copied().collect()),
        ("inside out", moved(&|p| (p, -p))),
        ("normals at random", moved(&|p| (p, alternating(p)))),
        ("normals of different lengths", moved(&|p| (p, (1e-9 + p.x.abs() * 1e9) * p))),
        ("huge", moved(&|p| (1e30 * p, p))),
        ("tiny", moved(&|p| (1e-30 * p, p))),
        ("far away", moved(&|p| (p + DVec3::splat(1e6), p))),
        ("two balls far apart", ball.iter().map(|&(p, n)| (if p.x > 0.0 { p + far } else { p }, n)).collect()),
        ("a half", sphere(0.0, |p| p.z > 0.0)),
        ("a tenth", sphere(0.0, |p| p.z > 0.8)),
        ("a hundred points", ball.iter().step_by(ball.len() / 100).copied().take(100).collect()),
    ];
    for (name, cloud) in clouds {
        match file::parse(xyz(&cloud).as_bytes(), Path::new("hard.xyz")) {
            Err(error) => {
                assert_eq!(name, "one point many times");
                assert!(error.to_string().contains("hard.xyz: no surface fits the points"), "{error}");
            }
            Ok(contents) => {
                let facts = Facts::of(&contents.mesh);
                assert_eq!([facts.open_edges, facts.branching_edges], [0, 0], "{name}");
                crate::probe::Scene::new(&contents.mesh, 10.0).unwrap();
            }
        }
    }
}

#[test]
fn the_same_points_give_the_same_bytes_on_any_number_of_threads() {
    let text = xyz(&sphere(1.0, |_| true));
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| read(text.as_bytes(), "sphere.xyz"))
    };
    let one = on(1);
    for threads in [2, 5] {
        let other = on(threads);
        assert_eq!((one.mesh.checksum(), &one.notes), (other.mesh.checksum(), &other.notes));
    }
}

#[test]
fn a_cloud_without_views_or_normals_is_refused() {
    let text: String = sphere(0.0, |_| true).iter().map(|(p, _)| format!("{} {} {}\n", p.x, p.y, p.z)).collect();
    let error = refusal(text.as_bytes(), "sphere.xyz");
    assert!(error.starts_with("sphere.xyz: the points have neither normals nor viewpoints"), "{error}");
    assert!(error.contains("normal_x") && error.contains("VIEWPOINT"), "{error}");
}

#[test]
fn a_bad_line_of_xyz_is_named() {
    for (bad, what) in [("1 2\n", "2 numbers"), ("1 2 x 0 0 1\n", "\"x\" is not a number"), ("1 2 3\n", "3 numbers")] {
        let error = refusal(format!("# x y z\n1 2 3 0 0 1\n{bad}").as_bytes(), "cup.xyz");
        assert!(error.starts_with("cup.xyz:3: ") && error.contains(what), "{error}");
    }
    let error = refusal(b"1 2 3 4\n", "cup.xyz");
    assert!(error.starts_with("cup.xyz:1: ") && error.contains("4 numbers"), "{error}");
    let error = refusal(b"1 2 3 0 0 1\n", "cup.xyz");
    assert!(error.contains("1 point with coordinates, where a surface needs 100"), "{error}");
}

const FIELDS: &str =
    "FIELDS x y z rgb normal_x normal_y normal_z\nSIZE 4 4 4 4 4 4 4\nTYPE F F F U F F F\nCOUNT 1 1 1 1 1 1 1\n";

fn pcd_header(points: usize, data: &str) -> String {
    format!(
        "# .PCD v0.7\nVERSION 0.7\n{FIELDS}WIDTH {points}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA {data}\n"
    )
}

/// Numbers of each point, as bytes in the order of the fields.
fn pcd_rows(points: &[(DVec3, DVec3)]) -> Vec<[[u8; 4]; 7]> {
    let bytes = |value: f64| (value as f32).to_le_bytes();
    let row =
        |(p, n): &(DVec3, DVec3)| [bytes(p.x), bytes(p.y), bytes(p.z), [7; 4], bytes(n.x), bytes(n.y), bytes(n.z)];
    points.iter().map(row).collect()
}

/// LZF with literal runs alone, which any reader unpacks.
fn packed(bytes: &[u8]) -> Vec<u8> {
    bytes.chunks(32).flat_map(|run| std::iter::once(run.len() as u8 - 1).chain(run.iter().copied())).collect()
}

#[test]
fn a_pcd_gives_one_surface_as_text_binary_and_compressed() {
    let points = sphere(0.5, |_| true);
    let points: Vec<_> = points.into_iter().map(|(p, n)| (p.as_vec3().as_dvec3(), n.as_vec3().as_dvec3())).collect();
    let count = points.len();
    let lines = points.iter().map(|(p, n)| format!("{} {} {} 7 {} {} {}\n", p.x, p.y, p.z, n.x, n.y, n.z));
    let text = pcd_header(count, "ascii") + &lines.collect::<String>();
    let rows = pcd_rows(&points);
    let mut binary = pcd_header(count, "binary").into_bytes();
    binary.extend(rows.iter().flatten().flatten());
    let columns: Vec<u8> = (0..7).flat_map(|column| rows.iter().flat_map(move |row| row[column])).collect();
    let data = packed(&columns);
    let mut compressed = pcd_header(count, "binary_compressed").into_bytes();
    compressed.extend((data.len() as u32).to_le_bytes());
    compressed.extend((columns.len() as u32).to_le_bytes());
    compressed.extend(data);
    let text = read(text.as_bytes(), "sphere.pcd");
    assert_eq!(text.format, file::Format::Pcd);
    assert_sound(&text.mesh);
    for other in [&binary, &compressed] {
        // The content decides what a file is.
        assert_eq!(read(other, "sphere.dat").mesh.checksum(), text.mesh.checksum());
    }
    let error = refusal(&binary[..binary.len() - 1], "sphere.pcd");
    assert!(error.starts_with("sphere.pcd: byte ") && error.contains("ends before its 4000 points do"), "{error}");
    let error = refusal(&compressed[..compressed.len() - 1], "sphere.pcd");
    assert!(error.contains("ends before its compressed data do"), "{error}");
}

#[test]
fn copies_in_compressed_data_are_unpacked_and_damaged_ones_are_refused() {
    // Four literals, a copy of 3 bytes from 4 before, a long copy of 10 from 1 before.
    let data = [3, b'a', b'b', b'c', b'd', 0b0010_0000, 3, 0b1110_0000, 1, 0];
    assert_eq!(super::pcd::unpack(&data, 17).unwrap(), b"abcdabccccccccccc");
    assert_eq!(super::pcd::unpack(&data, 16), Err(7));
    assert_eq!(super::pcd::unpack(&[0b0010_0000, 3], 3), Err(0), "a copy from before the first byte");
    assert_eq!(super::pcd::unpack(&[3, 1], 4), Err(0), "a run that is cut");
}

#[test]
fn a_pcd_is_seen_from_its_viewpoint_and_points_that_were_not_measured_are_counted() {
    let seen = sphere(0.0, |direction| direction.z > 0.2);
    let header =
        format!("VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {}\nHEIGHT 1\n", seen.len() + 1);
    let lines: String =
        seen.iter().map(|(p, _)| format!("{} {} {}\n", p.x, p.y, p.z)).collect::<String>() + "nan nan nan\n";
    let from = |place: &str| header.clone() + &format!("VIEWPOINT {place} 1 0 0 0\nDATA ascii\n") + &lines;
    let contents = read(from("0 0 400").as_bytes(), "cap.pcd");
    assert!(Facts::of(&contents.mesh).is_right_side_out());
    assert!(contents.notes[0].contains("1 points without coordinates"), "{:?}", contents.notes);
    assert!(contents.notes.iter().any(|note| note.contains("one hole is closed")), "{:?}", contents.notes);
    // A viewpoint among the points is one that nobody set.
    let error = refusal(from("0 0 45").as_bytes(), "cap.pcd");
    assert!(error.contains("neither normals nor viewpoints"), "{error}");
}

#[test]
fn a_pcds_damaged_header_is_named_by_its_line() {
    let good = pcd_header(0, "ascii");
    for (from, to, what) in [
        ("SIZE 4 4 4", "SIZE 4 4 four", "cup.pcd:4: the PCD file is damaged: \"four\" is not a count"),
        ("DATA ascii", "DATA zip", "cup.pcd:11: the PCD file is damaged: \"DATA zip\""),
        ("FIELDS x y z", "FIELDS x y w", "no fields x, y and z"),
        ("TYPE F F F", "TYPE F F Q", "the field z is no number"),
        ("COUNT 1 1 1", "COUNT 1 1", "same number of words"),
        ("VIEWPOINT 0 0 0", "VIEWPOINT 0 0 up", "\"up\" is not a coordinate"),
    ] {
        let error = refusal(good.replace(from, to).as_bytes(), "cup.pcd");
        assert!(error.contains(what), "{error}");
    }
    let error = refusal((pcd_header(2, "ascii") + "1 2 3 4 5 6\n").as_bytes(), "cup.pcd");
    assert!(error.starts_with("cup.pcd:12: ") && error.contains("6 numbers, where its fields need 7"), "{error}");
    let error = refusal((pcd_header(2, "ascii") + "1 2 3 4 5 6 7\n").as_bytes(), "cup.pcd");
    assert!(error.contains("ends after 1 of its 2 points"), "{error}");
}

#[test]
fn a_ply_without_faces_gives_one_surface_as_text_and_binary() {
    // Numbers that are as exact in decimal digits as in binary ones.
    let exact = |place: DVec3| (place * 16.0).round() / 16.0;
    let points: Vec<_> = sphere(0.5, |_| true).into_iter().map(|(p, n)| (exact(p), exact(p + 400.0 * n))).collect();
    let header = |format: &str| {
        let properties: String =
            ["x", "y", "z", "vp_x", "vp_y", "vp_z"].map(|name| format!("property float {name}\n")).concat();
        format!(
            "ply\nformat {format} 1.0\nelement vertex {}\n{properties}element face 0\nproperty list uchar int vertex_indices\nend_header\n",
            points.len()
        )
    };
    let numbers = points.iter().map(|(p, eye)| [p.as_vec3().to_array(), eye.as_vec3().to_array()].concat());
    let line = |row: Vec<f32>| row.iter().map(f32::to_string).collect::<Vec<_>>().join(" ") + "\n";
    let text = header("ascii") + &numbers.clone().map(line).collect::<String>();
    let mut binary = header("binary_big_endian").into_bytes();
    binary.extend(numbers.flatten().flat_map(f32::to_be_bytes));
    let text = read(text.as_bytes(), "sphere.ply");
    assert_sound(&text.mesh);
    assert_eq!(read(&binary, "sphere.ply").mesh.checksum(), text.mesh.checksum());
}

/// Depth images of a sphere of 50 mm at the origin, from six sides, in a directory.
fn depth_images(place: &Path) {
    const WIDTH: usize = 120;
    std::fs::create_dir_all(place.join("depth")).unwrap();
    let mut cameras = Vec::new();
    for (number, axis) in [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z].into_iter().enumerate() {
        // The camera looks along its z axis.
        let (right, down) = (-axis).any_orthonormal_pair();
        let rotation = [right, down, -axis].map(|row| row.to_array()).concat();
        let pixel = |index: usize| {
            let [x, y] = [index % WIDTH, index / WIDTH].map(|at| (at as f64 - 60.0) / 400.0);
            // |t · (x, y, 1) − (0, 0, 400)| = 50
            let (a, b, c) = (x * x + y * y + 1.0, 400.0, 400.0 * 400.0 - 50.0 * 50.0);
            let root = b * b - a * c;
            if root < 0.0 { 0 } else { (((b - root.sqrt()) / a) * 10.0).round() as u16 }
        };
        let bytes: Vec<u8> = (0..WIDTH * WIDTH).flat_map(|index| pixel(index).to_be_bytes()).collect();
        let file = std::fs::File::create(place.join(format!("depth/{number:06}.png"))).unwrap();
        let mut encoder = png::Encoder::new(file, WIDTH as u32, WIDTH as u32);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Sixteen);
        encoder.write_header().unwrap().write_image_data(&bytes).unwrap();
        cameras.push(format!(
            "\"{number}\": {{\"cam_K\": [400, 0, 60, 0, 400, 60, 0, 0, 1], \"depth_scale\": 0.1, \"cam_R_w2c\": {rotation:?}, \"cam_t_w2c\": [0, 0, 400]}}"
        ));
    }
    std::fs::write(place.join(file::DEPTH_LIST), format!("{{{}}}", cameras.join(",\n"))).unwrap();
}

#[test]
fn depth_images_with_poses_become_a_surface_in_millimeters_named_after_their_folder() {
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path().join("ball");
    depth_images(&place);
    let source = directory.path().to_string_lossy().into_owned();
    let objects = crate::mesh::source::objects(&[source]).unwrap();
    let [object] = &objects[..] else { panic!("{} objects", objects.len()) };
    assert_eq!((object.name.as_str(), object.millimeters), ("ball", Some(1.0)));
    assert_sound(object.mesh());
    let [largest, mean] = errors(object.mesh());
    assert!(largest < 1.0 && mean < 0.3, "{largest} {mean}");
}

#[test]
fn what_is_wrong_with_depth_images_is_named() {
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path();
    depth_images(place);
    let list = place.join(file::DEPTH_LIST);
    let good = std::fs::read_to_string(&list).unwrap();
    let error = |text: &str| {
        std::fs::write(&list, text).unwrap();
        file::read(&list).unwrap_err().to_string()
    };
    assert!(
        error(&good.replace("\"cam_t_w2c\"", "\"t\""))
            .contains("scene_camera.json:1: the scan file is damaged: missing field")
    );
    assert!(error(&good.replace("\"cam_K\": [400", "\"cam_K\": [0")).contains("cam_K or depth_scale of image 0"));
    assert!(
        error(&good.replace("\"cam_R_w2c\": [", "\"cam_R_w2c\": [5, 0, 0, 0, 1, 0, 0, 0, 1], \"old\": ["))
            .contains("not a rotation")
    );
    std::fs::write(place.join("depth/000003.png"), "GIF").unwrap();
    assert!(error(&good).contains("000003.png"));
    std::fs::remove_file(place.join("depth/000003.png")).unwrap();
    assert!(error(&good).contains("000003.png"));
}
