//! Pictures by what must be in them.

use super::bars::{number, round_step};
use super::*;
use crate::mesh::{Axis, CornerDivision, CrossingVoids, Grid2, Grid3, VoidCell, VoidShape};

fn plate() -> Mesh {
    let axis = |n| Axis::uniform(0.0, 1.0, n).unwrap();
    Grid2::new([axis(2), axis(1)], "solid").mesh().unwrap()
}

#[test]
fn curves_pass_through_their_middle_nodes() {
    let mesh = plate();
    let bent: Vec<f64> = mesh
        .points
        .iter()
        .flat_map(|x| [0.0, 0.3 * x[0] * x[0]])
        .collect();
    let picture = Picture::plane(&mesh).unwrap().displacement(&bent).unwrap();
    let view = picture.view().unwrap();
    for face in &picture.faces {
        for side in face.shape.sides() {
            let curve = picture.curve(&view, face, side, true);
            let middle = view.put(picture.place(face.nodes[usize::from(side[2])], true));
            for k in 0..2 {
                // A Bezier curve of degree two in its middle.
                let half = 0.25 * curve[0][k] + 0.5 * curve[1][k] + 0.25 * curve[2][k];
                assert!((half - middle[k]).abs() < 1e-9);
            }
        }
    }
}

#[test]
fn both_axes_have_one_scale_and_up_is_up() {
    let mesh = plate();
    let view = Picture::plane(&mesh).unwrap().view().unwrap();
    assert_eq!(view.size, [ROOM[1], ROOM[1]]);
    let [low, high] = [view.put([0.0, 0.0]), view.put([1.0, 1.0])];
    assert!((high[0] - low[0] - ROOM[1]).abs() < 1e-9);
    assert!((low[1] - high[1] - ROOM[1]).abs() < 1e-9);
}

#[test]
fn patches_cover_the_reference_cell() {
    let area = |corners: &[[f64; 2]]| -> f64 {
        let n = corners.len();
        let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
        (0..n)
            .map(|k| cross(corners[k], corners[(k + 1) % n]))
            .sum::<f64>()
            / 2.0
    };
    for (shape, counts, whole) in [
        (CellShape::Quad9, [5, 2], 4.0),
        (CellShape::Tri7, [5, 5], 0.5),
    ] {
        let sum: f64 = patches(shape, counts).iter().map(|patch| area(patch)).sum();
        assert!((sum - whole).abs() < 1e-12);
    }
}

#[test]
fn a_marked_curve_is_whole_and_a_marked_region_has_its_outline() {
    let axis = |n| Axis::uniform(0.0, 1.0, n).unwrap();
    let mesh = Grid2::new([axis(4), axis(3)], "solid").mesh().unwrap();
    let count = |nodes: &[u32]| {
        let picture = Picture::plane(&mesh).unwrap().mark("a & b", nodes);
        let svg = picture.svg().unwrap();
        assert!(svg.contains(">a &amp; b</text>"));
        // Once more beside its name.
        svg.matches("stroke=\"#e6194b\"").count() - 1
    };
    assert_eq!(count(&mesh.nodes_of("top").unwrap()), 4);
    let all = mesh.nodes_of_region("solid").unwrap();
    assert_eq!(all.len(), mesh.points.len());
    assert_eq!(count(&all), 2 * (4 + 3));
    assert_eq!(mesh.nodes_of_region("top"), None);
}

/// Of each obstacle every point that is drawn lies on it, and as much is drawn as it has within
/// the picture.
#[test]
fn obstacles_are_drawn_where_they_are() {
    let mesh = plate();
    let (middle, radius) = ([0.3, 0.9, 0.0], 0.05);
    for (shape, length) in [
        (
            Shape::Sphere {
                centre: middle,
                radius,
            },
            std::f64::consts::TAU * radius,
        ),
        (
            Shape::HalfSpace {
                point: middle,
                normal: [0.0, -1.0, 0.0],
            },
            1.0,
        ),
        (
            Shape::Punch {
                point: middle,
                axis: [0.0, 1.0, 0.0],
                flat: 0.03,
                rim: 0.03,
            },
            2.0 * (0.03 + 0.5 * std::f64::consts::PI * 0.03 + 0.37),
        ),
    ] {
        let shift = [0.1, -0.3, 0.0];
        let picture = Picture::plane(&mesh).unwrap().obstacle(shape, shift);
        let view = picture.view().unwrap();
        let svg = picture.svg().unwrap();
        let path = svg.split("stroke=\"#777\"").nth(1).unwrap();
        let path = path.split('"').nth(5).unwrap();
        let mut drawn = 0.0;
        for piece in path.split('M').skip(1) {
            let ends: Vec<[f64; 2]> = piece
                .split('L')
                .map(|end| {
                    let (x, y) = end.split_once(' ').unwrap();
                    view.place([x.parse().unwrap(), y.parse().unwrap()])
                })
                .collect();
            for &[x, y] in &ends {
                let gap = shape.gap([x, y, 0.0], shift).distance;
                assert!(gap.abs() * view.scale < 0.5, "{shape:?} {x} {y} {gap}");
            }
            drawn += (ends[0][0] - ends[1][0]).hypot(ends[0][1] - ends[1][1]);
        }
        // The paper goes a margin beyond the plate, and the net of points a step beyond that.
        let beyond = 2.0 * (MARGIN + 5.0) / view.scale;
        assert!(
            drawn > 0.99 * length && drawn < 1.01 * length + beyond,
            "{shape:?} {drawn} {length}"
        );
    }
}

#[test]
fn a_picture_has_its_outline_bars_and_colours() {
    let mesh = plate();
    let zero = vec![0.0; 2 * mesh.points.len()];
    let picture = Picture::plane(&mesh).unwrap();
    assert!(!picture.svg().unwrap().contains("dasharray"));
    let colours = Colours {
        title: "p < q",
        unit: "kPa",
        values: Values::Cells(&[1.0, f64::NAN]),
        range: Some([0.0, 1.0]),
        map: ColourMap::Sequential,
    };
    let svg = picture
        .length_unit("mm", 1e-3)
        .displacement(&zero)
        .unwrap()
        .colours(colours)
        .unwrap()
        .svg()
        .unwrap();
    assert!(svg.contains("dasharray"));
    assert!(svg.contains("p &lt; q [kPa]"));
    assert!(svg.contains(&ColourMap::Sequential.hex(1.0)));
    assert!(svg.contains("#bbbbbb"));
    assert!(svg.contains("200 mm"));
}

#[test]
fn a_scale_bar_has_the_unit_of_its_own_length() {
    let units = [("um", 1e-6), ("mm", 1e-3), ("cm", 1e-2)];
    for (sides, bar) in [
        ([2e-3, 2e-3], "200 um"),
        ([2e-3, 40e-3], "1 mm"),
        ([2e-3, 80e-3], "2 mm"),
        ([40e-3, 2e-3], "5 mm"),
        ([80e-3, 80e-3], "1 cm"),
        ([1e-9, 1e-9], "0.0002 um"),
    ] {
        let axis = |length| Axis::uniform(0.0, length, 2).unwrap();
        let mesh = Grid2::new(sides.map(axis), "strip").mesh().unwrap();
        let svg = Picture::plane(&mesh).unwrap().length_units(&units);
        let svg = svg.svg().unwrap();
        assert!(svg.contains(&format!(">{bar}<")), "{sides:?} {svg}");
    }
}

#[test]
fn a_surface_is_seen_along_its_normal() {
    let axis = |length| Axis::uniform(0.0, length, 2).unwrap();
    let mesh = Grid3::new([axis(1.0), axis(2.0), axis(3.0)], "solid")
        .mesh()
        .unwrap();
    for (name, axes) in [("top", [0, 1]), ("left", [1, 2]), ("front", [0, 2])] {
        let picture = Picture::surface(&mesh, name).unwrap();
        assert_eq!(picture.view[..2], along(axes)[..2]);
        assert_eq!(picture.faces.len(), 4);
    }
    assert!(matches!(
        Picture::surface(&mesh, "side"),
        Err(OutputError::NoSurface { .. })
    ));
    assert!(matches!(
        Picture::plane(&mesh),
        Err(OutputError::NotPlane { dimension: 3 })
    ));
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    let mesh = plate();
    let picture = || Picture::plane(&mesh).unwrap();
    assert!(picture().displacement(&[0.0]).is_err());
    let lost = vec![f64::NAN; 2 * mesh.points.len()];
    let error = picture().displacement(&lost).unwrap().svg().unwrap_err();
    assert!(matches!(error, OutputError::NoPlace { .. }));
    assert!(matches!(
        Picture::plane(&Mesh::default()),
        Err(OutputError::Nothing)
    ));
}

#[test]
fn steps_and_numbers_are_round() {
    for (length, step) in [(0.7, 0.5), (19.0, 10.0), (2.0, 2.0), (0.0034, 0.002)] {
        assert!((round_step(length) / step - 1.0).abs() < 1e-12);
    }
    assert_eq!(number(0.25, 0.05), "0.25");
    assert_eq!(number(20.0, 10.0), "20");
    assert_eq!(number(-1e-17, 0.5), "0.0");
    assert_eq!(number(3e-7, 1e-7), "3.0e-7");
}

/// For eyes: `cargo test -p taxel-fem a_void_cell_to_look_at -- --ignored` writes pictures
/// to the folder of `TAXEL_PICTURES`.
#[test]
#[ignore = "writes files to look at"]
fn a_void_cell_to_look_at() {
    let folder = std::env::var("TAXEL_PICTURES").unwrap();
    for fillet in [0.0, 6.0] {
        let cell = VoidCell {
            width: 400.0,
            height: 40.0,
            cover: 120.0,
            base: 100.0,
            pitch: 600.0,
            fillet,
            division: CornerDivision {
                segments: 3,
                largest: 1.0,
                ..CornerDivision::default()
            },
        };
        let mesh = cell.mesh().unwrap();
        // A made-up sinking of the cover, and its strength as the colour.
        let sinking = |x: [f64; 3]| {
            let over = (std::f64::consts::PI * x[0] / 600.0).cos().powi(2);
            -14.0 * over * (x[1] / 260.0).powi(2)
        };
        let displacement: Vec<f64> = mesh
            .points
            .iter()
            .flat_map(|&x| [0.02 * x[1] * x[0] / 300.0, sinking(x)])
            .collect();
        let height: Vec<f64> = mesh.points.iter().map(|&x| -sinking(x)).collect();
        let svg = Picture::plane(&mesh)
            .unwrap()
            .length_unit("um", 1.0)
            .displacement(&displacement)
            .unwrap()
            .colours(Colours {
                title: "sinking",
                unit: "um",
                values: Values::Nodes(&height),
                range: None,
                map: ColourMap::Sequential,
            })
            .unwrap()
            .svg()
            .unwrap();
        println!("{} cells, {} bytes", mesh.cell_count(), svg.len());
        std::fs::write(format!("{folder}/fillet-{fillet}.svg"), svg).unwrap();
    }
    // The outer side of a cell with crossing voids, by cells.
    let layer = CrossingVoids {
        width: 400.0,
        pitch: 600.0,
        base: 100.0,
        lower: 20.0,
        between: 140.0,
        upper: 20.0,
        cover: 140.0,
        smallest: 10.0,
        growth: 2.0,
        largest: 80.0,
        shape: VoidShape::Rectangle,
    };
    let mesh = layer.mesh().unwrap();
    let distance: Vec<f64> = (0..mesh.cell_count())
        .map(|cell| mesh.points[*mesh.cell(cell).last().unwrap() as usize])
        .map(|x| (x[1] - 150.0) * (x[2] - 210.0) * 1e-3)
        .collect();
    let svg = Picture::surface(&mesh, "left")
        .unwrap()
        .length_unit("um", 1.0)
        .colours(Colours {
            title: "product",
            unit: "",
            values: Values::Cells(&distance),
            range: Some([-30.0, 30.0]),
            map: ColourMap::Diverging,
        })
        .unwrap()
        .svg()
        .unwrap();
    std::fs::write(format!("{folder}/crossing.svg"), svg).unwrap();
}

#[test]
fn a_body_in_space_shows_the_sides_that_look_to_the_eye() {
    let axis = || Axis::uniform(0.0, 1.0, 1).unwrap();
    let block = Grid3::new([axis(), axis(), axis()], "solid")
        .mesh()
        .unwrap();
    let filled = |to_eye: [f64; 3]| {
        let svg = Picture::body(&block, to_eye).unwrap().svg().unwrap();
        svg.matches("fill=\"#e8ebf0\"").count()
    };
    // To a corner from before and from behind, and along an axis.
    assert_eq!(filled([1.0, -2.0, 1.0]), 3);
    assert_eq!(filled([1.0, 1.0, -0.1]), 3);
    assert_eq!(filled([0.0, 0.0, -1.0]), 1);
    assert!(Picture::body(&block, [0.0; 3]).is_err());
}
