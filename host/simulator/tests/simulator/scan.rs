#[expect(dead_code, reason = "one of its searches is compared")]
#[path = "../../src/mesh/scan/near.rs"]
mod near;

use glam::{DVec3, Vec3};
use palpate_simulator::mesh::Mesh;
use palpate_simulator::mesh::facts::Facts;
use palpate_simulator::mesh::file;
use palpate_simulator::random::{self, Purpose};
use rand_distr::{Distribution, Normal, UnitSphere};
use std::path::Path;

/// Points of a sphere of 50 about the origin, with its normals: 4,000, with Gaussian noise of this size along each axis.
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
    // The hole is below, where the ball may have stood.
    let note = note.strip_suffix(", the underside").unwrap();
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
                let said = match name {
                    "one point many times" => "no surface fits the points",
                    // Nothing is between their sides, or they have none.
                    "a plane with both sides" | "a line" | "normals at random" => "it is unknown which side",
                    _ => panic!("{name}: {error}"),
                };
                assert!(error.to_string().starts_with(&format!("hard.xyz: {said}")), "{error}");
            }
            Ok(contents) => {
                let facts = Facts::of(&contents.mesh);
                assert_eq!([facts.open_edges, facts.branching_edges], [0, 0], "{name}");
                palpate_simulator::probe::Scene::new(&contents.mesh, 10.0).unwrap();
            }
        }
    }
}

#[test]
fn the_same_points_give_the_same_bytes_on_any_number_of_threads() {
    let text = xyz(&sphere(1.0, |_| true));
    let unsigned = plain(&sphere(1.0, |_| true));
    for text in [text, unsigned] {
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
}

#[test]
fn neighbors_are_the_nearest_points_that_are_kept() {
    let places: Vec<DVec3> = sphere(3.0, |_| true).into_iter().map(|(place, _)| place).collect();
    let is_kept = |one: usize, two: usize| places[one].dot(places[two]) > 0.0 && !two.is_multiple_of(3);
    let found = near::Near::new(&places).each(40, 4, is_kept, |_, near| {
        let mut numbers: Vec<u32> = near.iter().map(|(_, number)| *number).collect();
        numbers.sort_unstable();
        numbers
    });
    for (one, found) in found.iter().enumerate().step_by(97) {
        let mut all: Vec<u32> = (0..places.len() as u32).collect();
        all.sort_by(|a, b| {
            let [a, b] = [a, b].map(|&other| places[other as usize].distance_squared(places[one]));
            a.total_cmp(&b)
        });
        let mut nearest: Vec<u32> =
            all.into_iter().take(160).filter(|&two| is_kept(one, two as usize)).take(40).collect();
        nearest.sort_unstable();
        assert_eq!(*found, nearest);
    }
}

/// A PCD of points, with normals or without, as seen from a place.
fn pcd(points: &[(DVec3, DVec3)], has_normals: bool, viewpoint: &str) -> String {
    let (count, names) = (points.len(), if has_normals { " normal_x normal_y normal_z" } else { "" });
    let columns = if has_normals { 6 } else { 3 };
    let header = format!(
        "VERSION 0.7\nFIELDS x y z{names}\nSIZE{}\nTYPE{}\nWIDTH {count}\nHEIGHT 1\nVIEWPOINT {viewpoint}\nDATA ascii\n",
        " 4".repeat(columns),
        " F".repeat(columns)
    );
    let line = |(p, n): &(DVec3, DVec3)| match has_normals {
        true => format!("{} {} {} {} {} {}\n", p.x, p.y, p.z, n.x, n.y, n.z),
        false => format!("{} {} {}\n", p.x, p.y, p.z),
    };
    header + &points.iter().map(line).collect::<String>()
}

const DEFAULT: &str = "0 0 0 1 0 0 0";

fn moved(points: Vec<(DVec3, DVec3)>, by: DVec3) -> Vec<(DVec3, DVec3)> {
    points.into_iter().map(|(place, normal)| (place + by, normal)).collect()
}

/// Points whose normals are turned where `is_turned` says so.
fn turned(points: &[(DVec3, DVec3)], is_turned: impl Fn(usize) -> bool) -> Vec<(DVec3, DVec3)> {
    let turn =
        |(index, &(place, normal)): (usize, &(DVec3, DVec3))| (place, if is_turned(index) { -normal } else { normal });
    points.iter().enumerate().map(turn).collect()
}

/// Asserts that a surface is the sphere about a place, and gives its notes.
fn assert_sphere(contents: &file::Contents, middle: DVec3) -> String {
    assert_sound(&contents.mesh);
    let middle = middle - DVec3::from(contents.moved);
    let centered = |vertex: &[f32; 3]| (Vec3::from(*vertex).as_dvec3() - middle).as_vec3().to_array();
    let vertices = contents.mesh.vertices.iter().map(centered).collect();
    let [largest, mean] = errors(&Mesh { vertices, triangles: Vec::new() });
    assert!(largest < 3.0 && mean < 0.8, "{largest} {mean} {:?}", contents.notes);
    contents.notes.join("\n")
}

#[test]
fn normals_of_a_pcd_win_over_a_default_viewpoint() {
    let middle = DVec3::new(450.0, 100.0, 200.0);
    let points = moved(sphere(0.2, |_| true), middle);
    let said = assert_sphere(&read(pcd(&points, true, DEFAULT).as_bytes(), "ball.pcd"), middle);
    assert!(!said.contains("normals"), "{said}");
    // Each point's place of the sensor, which nobody set either.
    let names =
        ["x", "y", "z", "nx", "ny", "nz", "vp_x", "vp_y", "vp_z"].map(|name| format!("property float {name}\n"));
    let header = format!("ply\nformat ascii 1.0\nelement vertex {}\n{}end_header\n", points.len(), names.concat());
    let rows: String =
        points.iter().map(|(p, n)| format!("{} {} {} {} {} {} 0 0 0\n", p.x, p.y, p.z, n.x, n.y, n.z)).collect();
    assert_sphere(&read((header + &rows).as_bytes(), "ball.ply"), middle);
}

#[test]
fn a_viewpoint_that_cannot_have_seen_all_points_is_not_used() {
    let middle = DVec3::new(450.0, 100.0, 200.0);
    let points = moved(sphere(0.2, |_| true), middle);
    for viewpoint in [DEFAULT, "900 0 0 1 0 0 0"] {
        let said = assert_sphere(&read(pcd(&points, false, viewpoint).as_bytes(), "ball.pcd"), middle);
        assert!(said.contains("not all points can be seen from the viewpoint"), "{said}");
    }
    let said = assert_sphere(&read(pcd(&points, true, "900 0 0 1 0 0 0").as_bytes(), "ball.pcd"), middle);
    assert!(said.contains("normals disagree with the viewpoint at") && said.contains("they decide"), "{said}");
}

#[test]
fn a_default_viewpoint_that_fits_the_points_is_used() {
    // As a camera sees it in its own frame.
    let seen = moved(sphere(0.2, |direction| direction.z < -0.2), 400.0 * DVec3::Z);
    let contents = read(pcd(&seen, false, DEFAULT).as_bytes(), "ball.pcd");
    assert!(Facts::of(&contents.mesh).is_right_side_out());
    assert!(!contents.notes.concat().contains("outside"), "{:?}", contents.notes);
    // What is closed is not, from inside.
    let front = contents.mesh.vertices.iter().map(|vertex| vertex[2]).fold(f32::INFINITY, f32::min);
    assert!((front - 350.0).abs() < 2.0, "{front}");
}

#[test]
fn normals_that_disagree_with_a_stated_viewpoint_are_turned_and_counted() {
    let seen = turned(&sphere(0.2, |direction| direction.z > 0.2), |index| index % 4 == 0);
    let contents = read(pcd(&seen, true, "0 0 400 1 0 0 0").as_bytes(), "cap.pcd");
    assert!(Facts::of(&contents.mesh).is_right_side_out());
    let said = contents.notes.concat();
    assert!(said.contains("normals disagree with the viewpoint: 25.0 % turned"), "{said}");
}

#[test]
fn normals_without_a_common_side_are_turned_to_that_of_their_neighbors() {
    for noise in [0.0, 0.5] {
        let ball = sphere(noise, |_| true);
        let some = turned(&ball, |index| index * 7 % 10 < 3);
        let said = assert_sphere(&read(xyz(&some).as_bytes(), "ball.xyz"), DVec3::ZERO);
        assert!(said.contains("normals have no common side: 30.0 % turned"), "{said}");
        // As programs that estimate normals leave them.
        let upward: Vec<_> = ball.iter().map(|&(p, n)| (p, if n.z < 0.0 { -n } else { n })).collect();
        let said = assert_sphere(&read(xyz(&upward).as_bytes(), "ball.xyz"), DVec3::ZERO);
        assert!(said.contains("normals have no common side: "), "{said}");
        let said = assert_sphere(&read(xyz(&turned(&ball, |_| true)).as_bytes(), "ball.xyz"), DVec3::ZERO);
        assert!(said.contains("all normals point inward: they are turned"), "{said}");
        let said = assert_sphere(&read(xyz(&ball).as_bytes(), "ball.xyz"), DVec3::ZERO);
        assert!(!said.contains("normals"), "{said}");
    }
}

#[test]
fn normals_of_a_thin_sheet_stay_on_their_sides() {
    // Closer to each other than points are on either side.
    let sheet: Vec<_> = sphere(0.0, |_| true)
        .iter()
        .map(|&(p, n)| (DVec3::new(p.x, p.y, 0.02 * p.z), n.z.signum() * DVec3::Z))
        .collect();
    let contents = read(xyz(&sheet).as_bytes(), "sheet.xyz");
    assert!(!contents.notes.concat().contains("normals"), "{:?}", contents.notes);
}

#[test]
fn normals_that_do_not_stand_on_the_surface_are_not_used() {
    let wrong: Vec<_> = sphere(0.2, |_| true).into_iter().map(|(p, _)| (p, DVec3::new(1.0, -1.0, 1.0))).collect();
    let said = assert_sphere(&read(xyz(&wrong).as_bytes(), "ball.xyz"), DVec3::ZERO);
    assert!(said.contains("do not stand on the surface, and are not used"), "{said}");
}

fn plain(points: &[(DVec3, DVec3)]) -> String {
    points.iter().map(|(p, _)| format!("{} {} {}\n", p.x, p.y, p.z)).collect()
}

#[test]
fn a_cloud_without_views_or_normals_is_turned_by_its_neighbors_if_it_is_closed_and_refused_if_not() {
    let said = assert_sphere(&read(plain(&sphere(0.2, |_| true)).as_bytes(), "ball.xyz"), DVec3::ZERO);
    assert!(said.contains("without normals and viewpoints, the points' neighbors say which side is outside"), "{said}");
    let error = refusal(plain(&sphere(0.2, |direction| direction.z > 0.0)).as_bytes(), "cap.xyz");
    assert!(error.starts_with("cap.xyz: it is unknown which side of the surface is outside"), "{error}");
    assert!(error.contains("normal_x") && error.contains("VIEWPOINT"), "{error}");
}

#[test]
fn colors_are_no_normals() {
    let ball = sphere(0.2, |_| true);
    let color = |n: &DVec3| (0.5 * (*n + DVec3::ONE) * 255.0).round();
    let bytes: String = ball.iter().map(|(p, n)| format!("{} {} {} {}\n", p.x, p.y, p.z, text(color(n)))).collect();
    let shares: String =
        ball.iter().map(|(p, n)| format!("{} {} {} {}\n", p.x, p.y, p.z, text(color(n) / 255.0))).collect();
    let one_color: String = ball.iter().map(|(p, _)| format!("{} {} {} 0 0 1\n", p.x, p.y, p.z)).collect();
    for content in [bytes, shares, one_color] {
        let said = assert_sphere(&read(content.as_bytes(), "ball.xyz"), DVec3::ZERO);
        assert!(said.contains("not used"), "{said}");
    }
}

fn text(vector: DVec3) -> String {
    format!("{} {} {}", vector.x, vector.y, vector.z)
}

#[test]
fn columns_of_xyz_are_those_that_a_header_names_or_that_normals_fill() {
    // Long and thin: the surface of few cells is soon made.
    let thin = |(p, n): (DVec3, DVec3)| (p * DVec3::new(1.0, 0.2, 0.2), (n * DVec3::new(0.2, 1.0, 1.0)).normalize());
    let ball: Vec<_> = sphere(0.0, |_| true).into_iter().take(160).map(thin).collect();
    let parsed = |content: &str| file::parse(content.as_bytes(), Path::new("ball.xyz"));
    let expected = read(xyz(&ball).as_bytes(), "ball.xyz");
    assert!(!expected.notes.concat().contains("normals"), "{:?}", expected.notes);
    let rows = |row: &dyn Fn(usize, DVec3, DVec3) -> String| -> String {
        ball.iter().enumerate().map(|(index, &(p, n))| row(index, p, n) + "\n").collect()
    };
    let usual = rows(&|_, p, n| format!("{} {}", text(p), text(n)));
    for content in [
        format!("x y z nx ny nz\n{usual}"),
        format!("//X Y Z Nx Ny Nz\n160\n{usual}"),
        format!("\"X\",\"Y\",\"Z\",\"Normal_X\",\"Normal_Y\",\"Normal_Z\"\n{usual}"),
        format!("160\n{usual}"),
        rows(&|index, p, n| format!("{} {} {}", text(p), text(n), index % 7)),
        rows(&|index, p, n| format!("{} {} {}", text(p), index % 7, text(n))),
        rows(&|index, p, n| format!("{} {} {} 255 {}", text(p), text(n), index % 256, index % 100)),
        rows(&|index, p, n| format!("{} {} 255 {} {}", text(p), index % 256, index % 100, text(n))),
        format!(
            "id nz ny nx z y x\n{}",
            rows(&|index, p, n| format!("{index} {} {} {} {} {} {}", n.z, n.y, n.x, p.z, p.y, p.x))
        ),
    ] {
        let found = read(content.as_bytes(), "ball.xyz");
        assert!((&found.mesh, &found.points) == (&expected.mesh, &expected.points), "{}", &content[..80]);
    }
    let said =
        |content: String| parsed(&content).map_or_else(|error| error.to_string(), |contents| contents.notes.concat());
    assert!(
        said(rows(&|index, p, _| format!("{} {index}", text(p))))
            .contains("column 4 is neither coordinates nor normals")
    );
    let error = |content: String| parsed(&content).err().map_or_else(String::new, |error| error.to_string());
    for (content, what) in [
        (format!("161\n{usual}"), "ball.xyz:161: the XYZ file is damaged: it states 161 points and has 160"),
        (rows(&|index, p, _| format!("{index} {}", text(p))), "its first column counts the points"),
        (
            rows(&|_, p, n| text(p).replace('.', ",") + " " + &text(n)),
            "ball.xyz:1: the XYZ file is damaged: commas stand in its numbers",
        ),
        (
            rows(&|_, p, n| format!("{} {}", text(p), text(700.5 * (n + DVec3::ONE)))),
            "columns 4 to 6 are neither normals nor colors",
        ),
        (
            rows(&|_, p, n| format!("{} {} -3.5", text(p), text(3.0 * n))),
            "which of its 7 columns are normals is unclear",
        ),
        (rows(&|_, p, n| format!("{} {} {}", text(p), text(n), text(n))), "several of its 9 columns may be normals"),
    ] {
        let error = error(content);
        assert!(error.contains(what), "{error}");
    }
}

#[test]
fn a_bad_line_of_xyz_is_named() {
    for (bad, what) in [("1 2\n", "2 numbers"), ("1 2 x 0 0 1\n", "\"x\" is not a number"), ("1 2 3\n", "3 numbers")] {
        let error = refusal(format!("# x y z\n1 2 3 0 0 1\n{bad}").as_bytes(), "cup.xyz");
        assert!(error.starts_with("cup.xyz:3: ") && error.contains(what), "{error}");
    }
    let error = refusal(b"1 2\n", "cup.xyz");
    assert!(error.starts_with("cup.xyz:1: ") && error.contains("2 numbers"), "{error}");
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

/// LZF whose copies are of what came `back` bytes before, the shortest and the longest among them.
fn packed(bytes: &[u8], back: usize) -> Vec<u8> {
    let (mut packed, mut place) = (Vec::new(), 0);
    while place < bytes.len() {
        let is_copy = |&ahead: &usize| place >= back && bytes[place + ahead] == bytes[place + ahead - back];
        let same = (0..264.min(bytes.len() - place)).take_while(is_copy).count();
        let [high, low] = [(back - 1) / 256, (back - 1) % 256].map(|byte| byte as u8);
        match same {
            0..3 => {
                let run = &bytes[place..][..back.saturating_sub(place).clamp(1, 32)];
                packed.push(run.len() as u8 - 1);
                packed.extend(run);
                place += run.len();
                continue;
            }
            3..9 => packed.extend([(same as u8 - 2) << 5 | high, low]),
            _ => packed.extend([7 << 5 | high, same as u8 - 9, low]),
        }
        place += same;
    }
    packed
}

#[test]
fn a_pcd_gives_one_surface_as_text_binary_and_compressed() {
    let points = sphere(0.5, |_| true);
    let points: Vec<_> = points.into_iter().map(|(p, n)| (p.as_vec3().as_dvec3(), n.as_vec3().as_dvec3())).collect();
    // Each run of points stands twice.
    let points: Vec<_> = points[..1_000].chunks(500).flat_map(|run| [run, run].concat()).collect();
    let count = points.len();
    let lines = points.iter().map(|(p, n)| format!("{} {} {} 7 {} {} {}\n", p.x, p.y, p.z, n.x, n.y, n.z));
    let text = pcd_header(count, "ascii") + &lines.collect::<String>();
    let rows = pcd_rows(&points);
    let mut binary = pcd_header(count, "binary").into_bytes();
    binary.extend(rows.iter().flatten().flatten());
    let columns: Vec<u8> = (0..7).flat_map(|column| rows.iter().flat_map(move |row| row[column])).collect();
    let data = packed(&columns, 2_000);
    let mut compressed = pcd_header(count, "binary_compressed").into_bytes();
    compressed.extend((data.len() as u32).to_le_bytes());
    compressed.extend((columns.len() as u32).to_le_bytes());
    compressed.extend(data);
    let text = read(text.as_bytes(), "sphere.pcd");
    assert_eq!(text.format, file::Format::Pcd);
    assert_sound(&text.mesh);
    for other in [&binary, &compressed] {
        // The content decides a file's kind.
        assert_eq!(read(other, "sphere.dat").mesh.checksum(), text.mesh.checksum());
    }
    let error = refusal(&binary[..binary.len() - 1], "sphere.pcd");
    assert!(error.starts_with("sphere.pcd: byte ") && error.contains("ends before its 2000 points do"), "{error}");
    let error = refusal(&compressed[..compressed.len() - 1], "sphere.pcd");
    assert!(error.contains("ends before its compressed data do"), "{error}");
}

#[test]
fn damaged_copies_in_compressed_data_are_refused() {
    // Four literals, a copy of 3 bytes from 4 before, a long copy of this number and 9 from 1 before.
    let data = |more| [3, b'a', b'b', b'c', b'd', 0b0010_0000, 3, 0b1110_0000, more, 0];
    for (data, at) in [
        (&data(11)[..], 10),
        (&data(13), 7),
        // A copy from before the first byte, and a run that is cut.
        (&[0b0010_0000, 3], 0),
        (&[3, 1], 0),
    ] {
        let mut bytes = pcd_header(1, "binary_compressed").into_bytes();
        let place = bytes.len() + 8 + at;
        bytes.extend((data.len() as u32).to_le_bytes());
        bytes.extend(28_u32.to_le_bytes());
        bytes.extend(data);
        let said = refusal(&bytes, "cup.pcd");
        assert!(said.starts_with(&format!("cup.pcd: byte {place}: ")), "{said}");
    }
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
    assert!(contents.notes[0].contains("1 point without coordinates is left out"), "{:?}", contents.notes);
    assert!(contents.notes.iter().any(|note| note.contains("one hole is closed")), "{:?}", contents.notes);
    // A viewpoint among the points is one that nobody set.
    let error = refusal(from("0 0 45").as_bytes(), "cap.pcd");
    assert!(error.contains("it is unknown which side of the surface is outside"), "{error}");
}

#[test]
fn a_pcds_damaged_header_is_named_by_its_line() {
    let good = pcd_header(0, "ascii");
    for (from, to, what) in [
        ("SIZE 4 4 4", "SIZE 4 4 four", "cup.pcd:4: the PCD file is damaged: \"four\" is not a count"),
        ("DATA ascii", "DATA zip", "cup.pcd:11: the PCD file is damaged: \"DATA zip\""),
        ("FIELDS x y z", "FIELDS x y w", "no fields x, y and z"),
        ("TYPE F F F", "TYPE F F Q", "the field z is not a number of a known kind"),
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

/// Writes an image in gray, of 16 bits or of 8.
fn write_gray(path: &Path, pixels: &[u16], is_depth: bool) {
    let file = std::fs::File::create(path).unwrap();
    let mut encoder = png::Encoder::new(file, WIDTH as u32, (pixels.len() / WIDTH) as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(if is_depth { png::BitDepth::Sixteen } else { png::BitDepth::Eight });
    let bytes: Vec<u8> = match is_depth {
        true => pixels.iter().flat_map(|pixel| pixel.to_be_bytes()).collect(),
        false => pixels.iter().map(|&pixel| pixel as u8).collect(),
    };
    encoder.write_header().unwrap().write_image_data(&bytes).unwrap();
}

const WIDTH: usize = 120;

const DEPTH_LIST: &str = "scene_camera.json";

/// Distance along a ray to the first surface: from a place, in a direction of any length.
type Scene<'a> = &'a dyn Fn(DVec3, DVec3) -> Option<f64>;

/// A camera's pose: the rows of its rotation and its translation.
type CameraPose = ([DVec3; 3], DVec3);

fn ball(middle: DVec3, radius: f64) -> impl Fn(DVec3, DVec3) -> Option<f64> {
    move |from, along| {
        let (a, b, c) =
            (along.dot(along), along.dot(from - middle), (from - middle).length_squared() - radius * radius);
        let root = b * b - a * c;
        (root >= 0.0).then(|| (-b - root.sqrt()) / a)
    }
}

/// The top of a table at a height, 500 mm long.
fn table_top(height: f64) -> impl Fn(DVec3, DVec3) -> Option<f64> {
    move |from, along| {
        let distance = (height - from.z) / along.z;
        let place = from + distance * along;
        (distance > 0.0 && place.x.abs().max(place.y.abs()) < 250.0).then_some(distance)
    }
}

/// The nearest of what two scenes have.
fn both(one: Scene, other: Scene) -> impl Fn(DVec3, DVec3) -> Option<f64> {
    move |from, along| [one(from, along), other(from, along)].into_iter().flatten().min_by(f64::total_cmp)
}

/// Depth images from these sides of the origin, 400 mm away, with the poses that `stated` makes of the right ones.
fn images(place: &Path, eyes: &[DVec3], scene: Scene, stated: impl Fn(CameraPose) -> CameraPose) {
    std::fs::create_dir_all(place.join("depth")).unwrap();
    let mut cameras = Vec::new();
    for (number, eye) in eyes.iter().enumerate() {
        // The camera looks along its z axis.
        let eye = 400.0 * eye.normalize();
        let ahead = -eye.normalize();
        let (right, down) = ahead.any_orthonormal_pair();
        let pixel = |index: usize| {
            let [x, y] = [index % WIDTH, index / WIDTH].map(|at| (at as f64 - 60.0) / 300.0);
            scene(eye, ahead + x * right + y * down).map_or(0, |depth| (depth * 10.0).round() as u16)
        };
        let pixels: Vec<u16> = (0..WIDTH * WIDTH).map(pixel).collect();
        write_gray(&place.join(format!("depth/{number:06}.png")), &pixels, true);
        let (rows, t) = stated(([right, down, ahead], 400.0 * DVec3::Z));
        let rotation = rows.map(|row| row.to_array()).concat();
        cameras.push(format!(
            "\"{number}\": {{\"cam_K\": [300, 0, 60, 0, 300, 60, 0, 0, 1], \"depth_scale\": 0.1, \"cam_R_w2c\": {rotation:?}, \"cam_t_w2c\": {:?}}}",
            t.to_array()
        ));
    }
    std::fs::write(place.join(DEPTH_LIST), format!("{{{}}}", cameras.join(",\n"))).unwrap();
}

const SIX: [DVec3; 6] = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z];

/// Depth images of a sphere of 50 mm at the origin, from six sides, in a directory.
fn depth_images(place: &Path) {
    images(place, &SIX, &ball(DVec3::ZERO, 50.0), |pose| pose);
}

/// Sides around and above.
fn above(count: usize) -> Vec<DVec3> {
    let side = |index: usize| {
        let (angle, height) = (std::f64::consts::TAU * index as f64 / count as f64, [0.4, 1.2][index % 2]);
        DVec3::new(libm::cos(angle), libm::sin(angle), height)
    };
    (0..count).map(side).collect()
}

fn scan(place: &Path) -> Result<file::Contents, String> {
    file::read(&place.join(DEPTH_LIST)).map_err(|error| error.to_string())
}

fn refused(place: &Path) -> String {
    scan(place).err().unwrap_or_default()
}

#[test]
fn a_table_under_an_object_is_left_out_and_its_underside_is_no_guess() {
    let directory = tempfile::tempdir().unwrap();
    let (place, middle) = (directory.path(), DVec3::new(0.0, 0.0, 20.0));
    // Most of a ball: its lower part is in the table.
    images(place, &above(8), &both(&ball(middle, 50.0), &table_top(0.0)), |pose| pose);
    let contents = scan(place).unwrap();
    let said = contents.notes.concat();
    assert!(said.contains("the widest plane, which extends beyond all else, is removed as a table"), "{said}");
    assert!(said.contains("the underside") && contents.guessed < 0.1, "{said} {}", contents.guessed);
    let [low, high] = contents.mesh.bounds();
    assert!((high - low).max_element() < 106.0 && (high.z - 70.0).abs() < 2.0 && low.z > -10.0, "{low} {high}");
    // Without the table the same is known: it was seen from all around and above.
    images(
        place,
        &above(8),
        &|from, along| ball(middle, 50.0)(from, along).filter(|t| (from + t * along).z > 0.0),
        |pose| pose,
    );
    let contents = scan(place).unwrap();
    let said = contents.notes.concat();
    assert!(!said.contains("table") && said.contains("the underside") && contents.guessed < 0.1, "{said}");
}

#[test]
fn the_top_of_a_box_is_no_table() {
    let directory = tempfile::tempdir().unwrap();
    let block = |from: DVec3, along: DVec3| {
        let [near, far] = [-50.0, 50.0].map(|side| (DVec3::splat(side) - from) / along);
        let (enter, leave) = (near.min(far).max_element(), near.max(far).min_element());
        (enter < leave).then_some(enter)
    };
    images(directory.path(), &above(8), &block, |pose| pose);
    let said = scan(directory.path()).unwrap().notes.concat();
    assert!(!said.contains("table"), "{said}");
}

#[test]
fn one_view_of_a_ball_leaves_a_guess() {
    let directory = tempfile::tempdir().unwrap();
    images(directory.path(), &[DVec3::new(0.2, 0.1, 1.0)], &ball(DVec3::ZERO, 50.0), |pose| pose);
    let contents = scan(directory.path()).unwrap();
    assert!(contents.guessed > 0.2, "{} {:?}", contents.guessed, contents.notes);
    let mut object = palpate_simulator::mesh::Object::new("ball", contents.mesh);
    let facts = Facts::of(object.mesh());
    assert_eq!(object.verdict(&facts, 5.0), "usable");
    object.guessed = contents.guessed;
    assert!(object.verdict(&facts, 5.0).starts_with("scan again: "), "{}", object.verdict(&facts, 5.0));
    assert!(object.complaints(&facts).concat().contains("% of the surface is a guess"));
}

/// A change of each camera's pose.
type Turned<'t> = &'t dyn Fn(CameraPose) -> CameraPose;

#[test]
fn usual_mistakes_of_cameras_are_named() {
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path();
    let [one, two] = [(DVec3::new(20.0, 0.0, 10.0), 40.0), (DVec3::new(-30.0, 10.0, -10.0), 25.0)]
        .map(|(middle, radius)| ball(middle, radius));
    let scene = both(&one, &two);
    let columns = |rows: [DVec3; 3]| glam::DMat3::from_cols(rows[0], rows[1], rows[2]).transpose();
    let rows = |matrix: glam::DMat3| [0, 1, 2].map(|row| matrix.row(row));
    let eyes = [&above(6)[..], &[DVec3::NEG_Z]].concat();
    images(place, &eyes, &scene, |pose| pose);
    assert!(scan(place).is_ok());
    let stated: [(Turned<'_>, &str, &str); 4] = [
        (&|(rows, t)| (rows, t / 1000.0), "cam_t_w2c is in meters", "multiply cam_t_w2c by 1000"),
        (&|([x, y, z], t)| ([x, -y, -z], -t), "those of OpenGL", "negate the second and the third row"),
        (
            &|(pose, t)| (rows(columns(pose).transpose()), -(columns(pose).transpose() * t)),
            "the poses are those of the cameras in the world",
            "-R times the translation",
        ),
        (&|(pose, t)| (rows(columns(pose).transpose()), t), "column by column", "row by row"),
    ];
    for (stated, cause, remedy) in stated {
        images(place, &eyes, &scene, stated);
        let error = refused(place);
        assert!(error.contains(cause) && error.contains(remedy), "{error}");
        assert!(error.contains("scene_camera.json: the depth images contradict each other: "), "{error}");
    }
    images(place, &eyes, &scene, |pose| pose);
    let list = place.join(DEPTH_LIST);
    let good = std::fs::read_to_string(&list).unwrap();
    std::fs::write(&list, good.replace("\"depth_scale\": 0.1, ", "")).unwrap();
    let error = refused(place);
    assert!(error.contains("if depth_scale is 0.100 and not 1.00"), "{error}");
    std::fs::write(&list, good.replace("\"depth_scale\": 0.1", "\"depth_scale\": 0.0001")).unwrap();
    let error = refused(place);
    assert!(error.contains("if depth_scale is 0.100 and not"), "{error}");
}

#[test]
fn masks_that_do_not_match_are_refused_and_any_object_can_be_chosen() {
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path().join("scene");
    let balls = [(DVec3::new(40.0, 0.0, 0.0), 30.0), (DVec3::new(-40.0, 0.0, 0.0), 20.0)];
    let [one, two] = balls.map(|(middle, radius)| ball(middle, radius));
    images(&place, &SIX, &both(&one, &two), |pose| pose);
    let masks = place.join("mask_visib");
    std::fs::create_dir(&masks).unwrap();
    let mask = |image: usize, object: usize| masks.join(format!("{image:06}_{object:06}.png"));
    for (image, axis) in SIX.iter().enumerate() {
        let (right, down) = (-*axis).any_orthonormal_pair();
        for (object, scene) in [&one as Scene, &two].into_iter().enumerate() {
            let other: Scene = [&two as Scene, &one][object];
            let is_seen = |index: usize| {
                let [x, y] = [index % WIDTH, index / WIDTH].map(|at| (at as f64 - 60.0) / 300.0);
                let (from, along) = (400.0 * *axis, x * right + y * down - *axis);
                let own = scene(from, along);
                u16::from(own.is_some_and(|own| other(from, along).is_none_or(|other| own < other))) * 255
            };
            write_gray(&mask(image, object), &(0..WIDTH * WIDTH).map(is_seen).collect::<Vec<_>>(), false);
        }
    }
    let source = place.to_str().unwrap().to_owned();
    let object = |source: &str| palpate_simulator::mesh::source::object(source);
    let size = |source: &str| {
        let object = object(source).unwrap();
        let [low, high] = object.mesh().bounds();
        (object.name, ((high - low).max_element() / 10.0).round() * 10.0, object.notes.concat())
    };
    let (name, length, notes) = size(&source);
    assert_eq!((name.as_str(), length), ("scene", 60.0));
    assert!(
        notes.contains("there are masks of 2 objects: 0 is taken") && notes.contains("scene_camera.json@1 is another"),
        "{notes}"
    );
    let (name, length, _) = size(&format!("{source}@000001"));
    assert_eq!((name.as_str(), length), ("scene@1", 40.0));
    assert_eq!(size(&format!("{source}/scene_camera.json@1")).1, 40.0);
    let error = |source: &str| object(source).unwrap_err().to_string();
    let said = error(&format!("{source}@2"));
    assert!(said.contains("masks of the objects 0, 1, and none of object 2"), "{said}");
    let ids = |second: u32| {
        (0..6)
            .map(|image| {
                format!("\"{image}\": [{{\"obj_id\": 5}}, {{\"obj_id\": {}}}]", if image == 3 { second } else { 7 })
            })
            .collect::<Vec<_>>()
            .join(",")
    };
    std::fs::write(place.join("scene_gt.json"), format!("{{{}}}", ids(8))).unwrap();
    let said = error(&format!("{source}@1"));
    assert!(said.contains("the masks of number 1 are of object 7 in image 0, and of 8 in 3"), "{said}");
    std::fs::write(place.join("scene_gt.json"), format!("{{{}}}", ids(7))).unwrap();
    assert_eq!(size(&format!("{source}@1")).1, 40.0);
    std::fs::remove_file(mask(3, 0)).unwrap();
    let said = error(&source);
    assert!(said.contains("000003_000000.png: the mask is missing, and other images have one"), "{said}");
    (0..6).filter(|image| *image != 3).for_each(|image| std::fs::remove_file(mask(image, 0)).unwrap());
    let said = error(&source);
    assert!(
        said.contains("masks of the objects 1, and none of object 0") && said.contains("scene_camera.json@1"),
        "{said}"
    );
    std::fs::remove_dir_all(&masks).unwrap();
    let said = error(&format!("{source}@1"));
    assert!(said.contains("object 1 is chosen, and no image has a mask"), "{said}");
}

#[test]
fn depth_images_with_poses_become_a_surface_in_millimeters_named_after_their_folder() {
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path().join("ball");
    depth_images(&place);
    let source = directory.path().to_string_lossy().into_owned();
    let objects = palpate_simulator::mesh::source::objects(&[source]).unwrap();
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
    let list = place.join(DEPTH_LIST);
    let good = std::fs::read_to_string(&list).unwrap();
    let error = |text: &str| {
        std::fs::write(&list, text).unwrap();
        file::read(&list).unwrap_err().to_string()
    };
    let said = error(&good.replace("\"cam_t_w2c\"", "\"t\""));
    assert!(said.contains("image 0, whose camera has no pose (cam_R_w2c and cam_t_w2c), is not read"), "{said}");
    assert!(said.contains("cam_R_m2c and cam_t_m2c in scene_gt.json"), "{said}");
    let said = error(&good.replace("\"cam_K\"", "\"K\""));
    assert!(said.contains("scene_camera.json:1: the scan file is damaged: missing field"), "{said}");
    assert!(error(&good.replace("\"cam_K\": [300", "\"cam_K\": [0")).contains("cam_K or depth_scale of image 0"));
    assert!(
        error(&good.replace("\"cam_R_w2c\": [", "\"cam_R_w2c\": [5, 0, 0, 0, 1, 0, 0, 0, 1], \"old\": ["))
            .contains("not a rotation")
    );
    std::fs::write(place.join("depth/000003.png"), "GIF").unwrap();
    assert!(error(&good).contains("000003.png"));
    std::fs::remove_file(place.join("depth/000003.png")).unwrap();
    assert!(error(&good).contains("000003.png"));
}
