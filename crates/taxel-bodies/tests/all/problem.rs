//! Problem files: the shipped ones are solved, mistakes are shown under the word, failures by
//! their cause.
#![allow(clippy::unwrap_used)]
#![allow(clippy::too_many_lines, reason = "a table of mistakes is read as one")]

use taxel::table::Cell;
use taxel_bodies::problem::{Body, Ended, ProblemFile};

fn shipped(name: &str) -> (&'static str, &'static [u8]) {
    let text = ProblemFile::shipped_text(name).unwrap();
    (text, ProblemFile::shipped_mesh(name).unwrap())
}

fn body(name: &str, text: &str, mesh: &[u8]) -> Result<Body, taxel::InputError> {
    let file = ProblemFile::parse(name, text)?;
    Body::new(file, (name, text), ("mesh.msh", mesh))
}

/// The numbers of a column, row by row.
fn column(body: &Body, name: &str) -> Vec<f64> {
    let columns = body.columns();
    let at = columns.iter().position(|column| column.name == name);
    let at = at.unwrap_or_else(|| panic!("no column {name}"));
    let cells = body.cells();
    let number = |row: &Vec<Cell>| match row[at] {
        Cell::Number(value) => value,
        _ => panic!("{name} is no number"),
    };
    cells.iter().map(number).collect()
}

fn solved(text: &str, mesh: &[u8]) -> Body {
    let mut body = body("problem.toml", text, mesh).unwrap();
    while body.done() < body.steps() {
        match body.step(|_| true) {
            Ok(ended) => assert_eq!(ended, Ended::Done),
            Err(failure) => panic!("{}", body.explain(&failure)),
        }
    }
    body
}

#[test]
fn a_pressed_dome_is_in_balance_and_its_capacitance_grows() {
    let (text, mesh) = shipped("dome");
    let body = solved(text, mesh);
    let plate = column(&body, "plate_force_y");
    let base = column(&body, "base_reaction_y");
    for (plate, base) in plate.iter().zip(&base) {
        // The tolerance of the iteration, of the force.
        assert!((plate + base).abs() <= 1e-6 * base.abs(), "{plate} {base}");
    }
    let capacitance = column(&body, "capacitance_upper_electrode_lower_electrode");
    assert!(capacitance.windows(2).all(|pair| pair[1] > pair[0]));
    // Hertz's force of a sphere on a rigid plate, 16/9 E sqrt(R) d^1.5 with E = 3 G: the base is
    // near and the dome gives way to the sides, so only the size of it.
    let hertz = 16.0 / 9.0 * 180e3 * 5e-3_f64.sqrt() * 0.25e-3_f64.powf(1.5);
    assert!(
        (0.5..2.0).contains(&(-plate[1] / hertz)),
        "{} {hertz}",
        plate[1]
    );
    let tip = column(&body, "tip_displacement_y");
    assert!((tip[6] + 1.5e-3).abs() < 1e-5, "{tip:?}");
    let picture = body.picture().unwrap();
    for name in ["upper_electrode", "lower_electrode"] {
        assert!(picture.contains(&format!(">{name}</text>")), "{name}");
    }
    assert!(picture.contains("stroke=\"#777\""), "the plate is drawn");
}

#[test]
fn a_microchannel_of_odd_shape_has_the_resistance_of_its_area() {
    let (text, mesh) = shipped("channel");
    let body = solved(text, mesh);
    let volume = column(&body, "microchannel_volume");
    let resistance = column(&body, "microchannel_resistance");
    for (volume, resistance) in volume.iter().zip(&resistance) {
        let exact = 0.294e-6 * 20e-3 * 20e-3 / volume;
        assert!((resistance / exact - 1.0).abs() < 1e-12);
    }
    assert!(resistance.windows(2).all(|pair| pair[1] > pair[0]));
    // The pressure on the whole top is carried by base alone: the sides slide.
    let base = column(&body, "base_reaction_y");
    assert!(
        (base[5] / (50e3 * 1.2e-3 * 20e-3) - 1.0).abs() < 1e-6,
        "{base:?}"
    );
}

#[test]
fn a_fingertip_slips_at_the_force_of_coulomb() {
    let (text, mesh) = shipped("fingertip");
    let body = solved(text, mesh);
    let along = column(&body, "plate_force_x");
    let press = column(&body, "plate_force_z");
    for (along, press) in along.iter().zip(&press) {
        assert!(
            along.abs() <= 0.5 * press.abs() * (1.0 + 1e-6),
            "{along} {press}"
        );
    }
    // It slides at last.
    assert!(
        (along[6] / press[6] - 0.3).abs() < 1e-4,
        "{along:?} {press:?}"
    );
}

#[test]
fn a_saved_state_goes_on_to_the_same_end() {
    let (text, mesh) = shipped("dome");
    let mut first = body("dome", text, mesh).unwrap();
    first.step(|_| true).unwrap();
    // Stopped in the middle of a step.
    let ended = first.step(|part| part < 0.2).unwrap();
    assert_eq!((ended, first.done()), (Ended::Stopped, 1));
    let saved = first.save("same");
    let mut second = body("dome", text, mesh).unwrap();
    assert!(second.restore(&saved, "other").is_err());
    assert!(second.restore(&saved[..saved.len() / 2], "same").is_err());
    second.restore(&saved, "same").unwrap();
    assert_eq!(second.save("same"), saved);
    for body in [&mut first, &mut second] {
        assert_eq!(body.step(|_| true).unwrap(), Ended::Done);
    }
    for name in [
        "plate_force_y",
        "capacitance_upper_electrode_lower_electrode",
    ] {
        let (one, other) = (column(&first, name), column(&second, name));
        assert_eq!(one.len(), 3);
        for (one, other) in one.iter().zip(&other) {
            assert!(one.to_bits() == other.to_bits(), "{name}: {one} {other}");
        }
    }
}

/// The message for a shipped problem with one text replaced.
#[track_caller]
fn refused(name: &str, from: &str, to: &str) -> String {
    let (text, mesh) = shipped(name);
    assert!(text.contains(from), "{name} has no {from}");
    let text = text.replacen(from, to, 1);
    match body("problem.toml", &text, mesh) {
        Ok(_) => panic!("not refused: {to}"),
        Err(error) => error.to_string(),
    }
}

/// A shipped problem, what is replaced in it and by what, and what the message must have.
type Mistake = (
    &'static str,
    &'static str,
    &'static str,
    &'static [&'static str],
);

const MISTAKES: &[Mistake] = &[
    (
        "dome",
        "on = \"axis\"",
        "on = \"axle\"",
        &["support.1.on", "^^^^^^", "axis, base"],
    ),
    (
        "dome",
        "held = [\"x\", \"y\"]",
        "held = [\"x\", \"z\"]",
        &["support.0.held.1", "does not extend along z"],
    ),
    (
        "dome",
        "\"1 mm\", \"1.25 mm\"",
        "\"1 kPa\", \"1.25 mm\"",
        &["parameter.0.values.3", "a length"],
    ),
    (
        "dome",
        "\"1 mm\", \"1.25 mm\"",
        "1, \"1.25 mm\"",
        &["has no unit"],
    ),
    (
        "dome",
        "by = \"travel\"",
        "by = \"trawel\"",
        &["obstacle.0.moved.by", "travel"],
    ),
    (
        "dome",
        "regions = [\"silicone\"]\nlaw",
        "regions = [\"rubber\"]\nlaw",
        &["material.0.regions.0", "silicone"],
    ),
    (
        "dome",
        "compressibility = \"incompressible\"\n",
        "",
        &["material.0", "compressibility is missing"],
    ),
    (
        "dome",
        "\"60 kPa\"",
        "\"-60 kPa\"",
        &["shear_modulus", "greater than 0"],
    ),
    (
        "dome",
        "schema = 1",
        "schema = 2",
        &["schema 2 is not known"],
    ),
    (
        "dome",
        "geometry = \"axisymmetric\"",
        "geometry = \"solid\"",
        &["dimension 2"],
    ),
    (
        "channel",
        "on = \"base\"\nheld = [\"x\", \"y\"]",
        "on = \"base\"\nheld = [\"x\"]",
        &["nothing holds the body"],
    ),
    (
        "dome",
        "normal = [0, -1, 0]",
        "normal = [0, 0, 1]",
        &["obstacle.0.shape.plane.normal", "zero"],
    ),
    (
        "dome",
        "friction = 0",
        "friction = -1",
        &["obstacle.0.friction"],
    ),
    (
        "dome",
        "[\"upper_electrode\", \"lower_electrode\"]",
        "[\"upper_electrode\"]",
        &["capacitance.electrodes"],
    ),
    (
        "dome",
        "regions = [\"silicone\"]\npermittivity = 2.8",
        "regions = []\npermittivity = 2.8",
        &[
            "capacitance.dielectric",
            "region \"silicone\" has no permittivity",
        ],
    ),
    (
        "fingertip",
        "{ plane_strain = { depth = \"15 mm\" } }",
        "\"plane_strain\"",
        &[
            "geometry",
            "keys of its own",
            "write one of: { plane_strain = { depth = … } }; \"axisymmetric\"; \"solid\"",
        ],
    ),
    (
        "fingertip",
        "{ plane_strain = { depth = \"15 mm\" } }",
        "{ plane_stress = {} }",
        &[
            "\"plane_stress\" is not known here",
            "write one of: { plane_strain",
        ],
    ),
    (
        "dome",
        "{ neo_hookean = { shear_modulus = \"60 kPa\" } }",
        "{ neo_hookean = \"60 kPa\" }",
        &[
            "material.0.law.neo_hookean",
            "a table is needed here, not the text \"60 kPa\"",
            "write { shear_modulus = … }",
        ],
    ),
    (
        "dome",
        "\"incompressible\"",
        "0.5",
        &[
            "material.0.compressibility",
            "text or a table is needed here",
            "\"incompressible\"; { quadratic = { bulk_modulus = … } }",
        ],
    ),
    (
        "dome",
        "[output]",
        "[[contact]]\nname = \"c\"\nsurfaces = [\"skin\", \"base\", \"axis\"]\nfriction = 0\n[output]",
        &["contact.0.surfaces", "3 names; exactly 2 are needed"],
    ),
    (
        "dome",
        "displacements = [\"tip\"]",
        "displacements = [\"skin\"]",
        &["nodes, not one"],
    ),
    (
        "channel",
        "cavity = \"microchannel\"",
        "cavity = \"channel\"",
        &["channel.0.cavity", "microchannel"],
    ),
    (
        "channel",
        "wall = [\"wall\"]",
        "wall = [\"base\"]",
        &["cavity.0.wall", "volume at rest"],
    ),
    (
        "channel",
        "pressure = \"pressure\"",
        "force = { by = \"pressure\", y = -1.0 }",
        &["parameter.0.values.0", "a force"],
    ),
    (
        "channel",
        "pressure = \"pressure\"\n\n",
        "\n",
        &["load.0", "exactly one"],
    ),
    (
        "channel",
        "c10 = \"75.5 kPa\"",
        "c10 = \"75.5 um\"",
        &["\"um\" is a unit of length"],
    ),
    (
        "fingertip",
        "moved = { by = \"slide\", x = 1 }\n",
        "",
        &["parameter.1.name", "nothing uses"],
    ),
    (
        "fingertip",
        "held = [\"x\"]\nmoved = { by = \"press\", z = -1 }",
        "held = [\"x\", \"z\"]\nmoved = { by = \"press\", z = -1 }",
        &["support.0.moved", "held and moved"],
    ),
    (
        "dome",
        "[[obstacle]]",
        "[[rigid]]\nname = \"lid\"\non = \"lid\"\n[[obstacle]]",
        &["rigid.0.on", "^^^^^", "base", "silicone"],
    ),
    (
        "dome",
        "[[obstacle]]",
        "[[rigid]]\nname = \"lid\"\non = \"base\"\n[[obstacle]]",
        &[
            "rigid.0.on",
            "rigid body 0",
            "a support (fixed in component",
        ],
    ),
    (
        "dome",
        "[[obstacle]]",
        "[[rigid]]\nname = \"plate\"\non = \"base\"\n[[obstacle]]",
        &["rigid.0.name", "called \"plate\""],
    ),
    (
        "dome",
        "[[obstacle]]",
        "[[rigid]]\nname = \"lid\"\non = \"skin\"\nunturned = [\"y\"]\n[[obstacle]]",
        &["rigid.0.unturned.0", "does not turn about y"],
    ),
    (
        "fingertip",
        "[[obstacle]]",
        "[[rigid]]\nname = \"lid\"\non = \"skin\"\nunturned = [\"z\"]\n[[obstacle]]",
        &["rigid.0.unturned.0", "it turns about y"],
    ),
    (
        "dome",
        "reactions = [\"base\"]",
        "reactions = [\"base\", \"base\"]",
        &["output.reactions.1", "called \"base\""],
    ),
    (
        "dome",
        "name = \"plate\"",
        "name = \" \"",
        &["obstacle.0.name", "empty"],
    ),
    (
        "fingertip",
        "name = \"slide\"",
        "name = \"press\"",
        &["parameter.1.name", "called \"press\""],
    ),
    (
        "dome",
        "values = [\"0.25 mm\", \"0.5 mm\", \"0.75 mm\", \"1 mm\", \"1.25 mm\", \"1.5 mm\"]",
        "values = []",
        &["parameter.0.values", "no value"],
    ),
    (
        "channel",
        "wall = [\"wall\"]",
        "wall = [\"wall\", \"wall\"]",
        &["cavity.0.wall.1", "before"],
    ),
    (
        "dome",
        "[\"upper_electrode\", \"lower_electrode\"]",
        "[\"upper_electrode\", \"upper_electrode\"]",
        &["capacitance.electrodes", "share node"],
    ),
    (
        "fingertip",
        "{ plane_strain = { depth = \"15 mm\" } }",
        "\"axisymmetric\"",
        &["geometry", "radius of -"],
    ),
    (
        "fingertip",
        "\"4 mm\"]",
        "\"4 mm\"]\nprescribes = \"torque\"",
        &["parameter.1.prescribes", "turns a rigid body"],
    ),
    (
        "fingertip",
        "[[obstacle]]",
        "[[rigid]]\nname = \"lid\"\non = \"skin\"\nturned = { by = \"slide\", y = 1 }\n[[obstacle]]",
        &["is a length here, but an angle in rigid.0.turned.by"],
    ),
    (
        "channel",
        "[[cavity]]",
        "[[constraint]]\nperiodic = [\"base\", \"wall\"]\n[[cavity]]",
        &["constraint.0.periodic", "opposite"],
    ),
    (
        "channel",
        "[[cavity]]",
        "[[constraint]]\nperiodic = [\"top\", \"base\"]\n[[cavity]]",
        &["constraint.0.periodic", "contradicts a support", "^^^^"],
    ),
    (
        "channel",
        "[[cavity]]",
        "[[constraint]]\nmean = { on = \"top\", along = \"y\" }\nmoved = { by = \"pressure\", y = 1 }\n[[cavity]]",
        &[
            "load.0.pressure",
            "is a stress here, but a length in constraint.0",
        ],
    ),
    (
        "channel",
        "[[cavity]]",
        "[[constraint]]\n[[cavity]]",
        &["constraint.0", "exactly one of periodic, mean and point"],
    ),
    (
        "fingertip",
        "[[obstacle]]",
        "[[constraint]]\npoint = { at = \"tip\", along = \"x\" }\n[[obstacle]]",
        &["constraint.0.point", "it follows nothing"],
    ),
    (
        "fingertip",
        "\"4 mm\"]",
        "]",
        &["parameter.1.values", "one for each step"],
    ),
];

#[test]
fn mistakes_are_shown_under_the_word() {
    for (name, from, to, parts) in MISTAKES {
        let message = refused(name, from, to);
        for part in *parts {
            assert!(message.contains(part), "{to}: {part} is not in\n{message}");
        }
    }
}

#[test]
fn a_force_that_is_prescribed_finds_its_way() {
    let (text, mesh) = shipped("dome");
    let by_way = solved(text, mesh);
    let force = -column(&by_way, "plate_force_y")[2];
    let values =
        "values = [\"0.25 mm\", \"0.5 mm\", \"0.75 mm\", \"1 mm\", \"1.25 mm\", \"1.5 mm\"]";
    assert!(text.contains(values));
    let given = format!("values = [\"{} mN\"]\nprescribes = \"force\"", 1e3 * force);
    let by_force = solved(&text.replace(values, &given), mesh);
    let way = column(&by_force, "travel_found")[1];
    // The multipliers of the contact leave an overlap of 1e-4 of a cell, some 0.05 um.
    assert!((way - 0.5e-3).abs() < 0.1e-6, "{way}");
}

#[test]
fn a_limit_of_the_load_is_said_with_the_remedy() {
    // Far beyond what the sheet over the microchannel bears: it closes without a contact.
    let (text, mesh) = shipped("channel");
    let values = "values = [\"10 kPa\", \"20 kPa\", \"30 kPa\", \"40 kPa\", \"50 kPa\"]";
    assert!(text.contains(values));
    let text = text.replace(values, "values = [\"10 MPa\"]");
    let mut body = body("problem.toml", &text, mesh).unwrap();
    let failure = body.step(|_| true).unwrap_err();
    let message = body.explain(&failure);
    for part in [
        "step 1",
        "% of the step was solved, up to pressure = ",
        "kPa",
        "help: ",
    ] {
        assert!(message.contains(part), "{part}: {message}");
    }
    // The last good state stays.
    assert_eq!(body.done(), 0);
    assert!(body.picture().unwrap().ends_with("</svg>\n"));
}

#[test]
fn what_conducts_is_what_insulates() {
    // The same potential: R C = rho epsilon, whatever the shape.
    let (text, mesh) = shipped("dome");
    let resistance = "[[resistance]]\nname = \"dome\"\nfrom = \"upper_electrode\"\n\
                      to = \"lower_electrode\"\n[[resistance.conductor]]\n\
                      regions = [\"silicone\"]\nresistivity = \"100 ohm m\"\n\n[output]";
    let body = solved(&text.replace("[output]", resistance), mesh);
    let capacitance = column(&body, "capacitance_upper_electrode_lower_electrode");
    let resistance = column(&body, "dome_resistance");
    for (c, r) in capacitance.iter().zip(&resistance) {
        assert!(
            (r * c / (100.0 * 2.8 * 8.8541878188e-12) - 1.0).abs() < 1e-9,
            "{r} {c}"
        );
    }
}

#[test]
fn a_beam_of_extruded_layers_bends_in_space() {
    let mesh = include_bytes!("../../../taxel-fem/tests/meshes/wedge15-4.1-binary.msh");
    let text = r#"
schema = 1
name = "beam of extruded layers"
geometry = "solid"
mesh = { file = "block.msh", unit = "10 mm" }

[[material]]
regions = ["soft"]
law = { ogden = [{ modulus = "60 kPa", exponent = 1.3 }, { modulus = "1 kPa", exponent = 5 }] }
compressibility = "incompressible"

[[material]]
regions = ["hard"]
law = { linear_elastic = { young_modulus = "2 MPa", poisson_ratio = 0.4 } }

[[parameter]]
name = "weight"
values = ["200 mN"]

[[support]]
on = "left"
held = ["x", "y", "z"]

[[load]]
on = "top"
force = { by = "weight", z = -1 }

[output]
reactions = ["left"]
"#;
    let body = solved(text, mesh);
    let reaction = column(&body, "left_reaction_z");
    assert!((reaction[1] / 0.2 - 1.0).abs() < 1e-6, "{reaction:?}");
    assert!(body.picture().unwrap().contains("<path fill=\"#"));
    let error = match self::body(
        "block.toml",
        &text.replace("[\"soft\"]", "[\"hard\"]"),
        mesh,
    ) {
        Ok(_) => panic!("not refused"),
        Err(error) => error.to_string(),
    };
    assert!(error.contains("\"hard\" has a material already"), "{error}");
}

#[test]
fn a_rough_plate_presses_a_dome_to_a_third_of_its_height() {
    let (text, mesh) = shipped("dome");
    let values =
        "values = [\"0.25 mm\", \"0.5 mm\", \"0.75 mm\", \"1 mm\", \"1.25 mm\", \"1.5 mm\"]";
    let text = text.replace(values, "values = [\"1.8 mm\"]");
    let smooth = solved(&text, mesh);
    let rough = solved(&text.replace("friction = 0\n", "friction = 0.5\n"), mesh);
    let [smooth, rough] = [smooth, rough].map(|body| column(&body, "plate_force_y")[1]);
    // What sticks can't spread: the force grows.
    assert!(
        rough < 1.001 * smooth && rough > 1.2 * smooth,
        "{rough} {smooth}"
    );
}

const PRESSURES: &str = "values = [\"10 kPa\", \"20 kPa\", \"30 kPa\", \"40 kPa\", \"50 kPa\"]";

#[test]
fn a_trapped_gas_has_the_pressure_of_its_volume() {
    let (text, mesh) = shipped("channel");
    let wall = "wall = [\"wall\"]\n";
    assert!(text.contains(wall) && text.contains(PRESSURES));
    let sealed = text.replace(wall, "wall = [\"wall\"]\ntrapped_gas = \"101.325 kPa\"\n");
    let sealed = solved(&sealed, mesh);
    let volume = column(&sealed, "microchannel_volume");
    let pressure = column(&sealed, "microchannel_pressure");
    for (v, p) in volume.iter().zip(&pressure) {
        let exact = 101325.0 * (volume[0] / v - 1.0);
        // The tolerance of the iteration, of the greatest pressure.
        assert!((p - exact).abs() < 1e-6 * 101325.0, "{p} {exact}");
    }
    let vented = column(&solved(text, mesh), "microchannel_volume");
    assert!(volume[5] > 1.01 * vented[5], "{volume:?} {vented:?}");
}

#[test]
fn a_volume_that_is_prescribed_finds_its_pressure() {
    let (text, mesh) = shipped("channel");
    let by_pressure = solved(text, mesh);
    let volume = column(&by_pressure, "microchannel_volume")[3];
    let given = format!(
        "values = [\"{} mm3\"]\nprescribes = {{ volume = {{ of = \"microchannel\" }} }}",
        1e9 * volume
    );
    let by_volume = solved(&text.replace(PRESSURES, &given), mesh);
    let pressure = column(&by_volume, "pressure_found")[1];
    assert!((pressure / 30e3 - 1.0).abs() < 1e-6, "{pressure}");
    let shown = column(&by_volume, "pressure")[1];
    assert!((shown / volume - 1.0).abs() < 1e-9, "{shown} {volume}");
}

/// Gmsh's text of a mesh: dimension, number and name of each group, places of the nodes, elements without
/// their numbers.
fn gmsh(groups: &[String], nodes: &[String], elements: &[String]) -> String {
    let numbered = |lines: &[String]| -> String {
        let lines = lines.iter().enumerate();
        let lines = lines.map(|(number, line)| format!("{} {line}\n", number + 1));
        format!("{}\n{}", lines.len(), lines.collect::<String>())
    };
    format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n{}\n{}\n$EndPhysicalNames\n\
         $Nodes\n{}$EndNodes\n$Elements\n{}$EndElements\n",
        groups.len(),
        groups.join("\n"),
        numbered(nodes),
        numbered(elements)
    )
}

/// Gmsh's text of half of a rectangular channel of 400 x 40 um under a cover of 140 um, on cells that
/// grow from 2 um at its corners.
fn channel() -> String {
    // Positions from `near` to `far` that double their distance.
    let growing = |near: f64, far: f64| {
        let mut steps = vec![2.0];
        while steps.iter().sum::<f64>() < (far - near).abs() {
            steps.push(60_f64.min(1.6 * steps[steps.len() - 1]));
        }
        let scale = (far - near) / steps.iter().sum::<f64>();
        let mut at = near;
        let mut all = vec![near];
        for step in steps {
            at += scale * step;
            all.push(at);
        }
        all
    };
    let joined = |parts: [Vec<f64>; 2]| {
        let [mut first, second] = parts;
        first.reverse();
        first.extend(&second[1..]);
        first
    };
    let x = joined([growing(200.0, 0.0), growing(200.0, 300.0)]);
    let mut y = joined([growing(320.0, 0.0), growing(320.0, 340.0)]);
    y.extend(&joined([growing(360.0, 340.0), growing(360.0, 500.0)])[1..]);
    let wide = x.len();
    let node = |i: usize, j: usize| j * wide + i + 1;
    let edges =
        |levels: &[f64], at: f64| levels.iter().position(|l| (l - at).abs() < 1e-6).unwrap();
    let (wall, floor, roof) = (edges(&x, 200.0), edges(&y, 320.0), edges(&y, 360.0));
    let solid = |i: usize, j: usize| i >= wall || j < floor || j >= roof;
    let mut elements = Vec::new();
    for j in 0..y.len() - 1 {
        for i in (0..wide - 1).filter(|&i| solid(i, j)) {
            let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
            let [a, b, c, d] = corners.map(|(i, j)| node(i, j));
            elements.push(format!("3 2 1 1 {a} {b} {c} {d}"));
        }
        let mut side = |group: usize, i: usize| {
            elements.push(format!("1 2 {group} 1 {} {}", node(i, j), node(i, j + 1)));
        };
        side(4, wide - 1);
        if solid(0, j) {
            side(4, 0);
        } else {
            side(5, wall);
        }
    }
    for i in 0..wide - 1 {
        let level =
            |group: usize, j: usize| format!("1 2 {group} 1 {} {}", node(i, j), node(i + 1, j));
        elements.extend([level(2, 0), level(3, y.len() - 1)]);
        if i < wall {
            elements.extend([level(5, floor), level(5, roof)]);
        }
    }
    let names = [
        "2 1 \"rubber\"",
        "1 2 \"base\"",
        "1 3 \"top\"",
        "1 4 \"sides\"",
        "1 5 \"wall\"",
    ];
    let places = y
        .iter()
        .flat_map(|y| x.iter().map(move |x| format!("{x} {y} 0")));
    let nodes: Vec<String> = places.collect();
    gmsh(&names.map(str::to_owned), &nodes, &elements)
}

/// A wall that touches itself folds about its sharp corners: the net pressure at 0.3 of the area is
/// that of `p4_net_pressure.csv`, and roof on floor goes on beyond.
#[test]
fn a_rectangular_channel_closes_and_goes_on() {
    let text = r#"
schema = 1
name = "rectangular channel"
geometry = { plane_strain = { depth = "1 mm" } }
mesh = { file = "mesh.msh", unit = "1 um" }

[[material]]
regions = ["rubber"]
law = { mooney_rivlin = { c10 = "75.5 kPa", c01 = "5.7 kPa" } }
compressibility = "incompressible"

[[parameter]]
name = "pressure"
values = ["7.22596 kPa", "12.48609 kPa", "14.4 kPa"]

[[support]]
on = "base"
held = ["x", "y"]

[[support]]
on = "sides"
held = ["x"]

[[load]]
on = "top"
pressure = "pressure"

[[cavity]]
name = "channel"
wall = ["wall"]

[[contact]]
name = "wall"
surfaces = ["wall", "wall"]
friction = 0

[output]
reactions = ["base"]
"#;
    let rows = solved(text, channel().as_bytes());
    let volumes = column(&rows, "channel_volume");
    for (row, ratio) in [(1, 0.6), (2, 0.3)] {
        let found = volumes[row] / volumes[0];
        assert!((found / ratio - 1.0).abs() < 3e-3, "{found} {ratio}");
    }
    // What a surface does to itself it suffers as well.
    assert!(column(&rows, "wall_contact_area")[3] > 0.0);
    for name in ["wall_force_x", "wall_force_y"] {
        assert_eq!(column(&rows, name), [0.0; 4]);
    }
    let touched = volumes[3] / volumes[0];
    assert!(touched > 0.2 && touched < 0.25, "{touched}");
}

/// Gmsh's text of two blocks of 10 mm of so many cells along their side, one on the other.
fn two_blocks(cells: [usize; 2]) -> String {
    let (mut nodes, mut elements) = (Vec::new(), Vec::new());
    for (block, count) in cells.into_iter().enumerate() {
        let first = nodes.len() + 1;
        let low = if block == 0 { -10.0 } else { 0.0 };
        let at = |i: usize, j: usize| first + j * (count + 1) + i;
        for j in 0..=count {
            for i in 0..=count {
                let [x, y] = [i, j].map(|k| 10.0 * k as f64 / count as f64);
                nodes.push(format!("{x} {} 0", low + y));
            }
        }
        let group = 10 * block;
        for j in 0..count {
            for i in 0..count {
                elements.push(format!(
                    "3 2 {} 1 {} {} {} {}",
                    1 + group,
                    at(i, j),
                    at(i + 1, j),
                    at(i + 1, j + 1),
                    at(i, j + 1)
                ));
            }
            let sides = [
                (2, at(j, 0), at(j + 1, 0)),
                (3, at(j, count), at(j + 1, count)),
                (4, at(0, j), at(0, j + 1)),
            ];
            for (side, a, b) in sides {
                elements.push(format!("1 2 {} 1 {a} {b}", side + group));
            }
        }
    }
    let names = ["", "body", "bottom", "top", "left"];
    let mut groups = Vec::new();
    for (group, part) in [(0, "lower"), (10, "upper")] {
        for (number, name) in names.iter().enumerate().skip(1) {
            let dimension = if number == 1 { 2 } else { 1 };
            let number = number + group;
            groups.push(format!("{dimension} {number} \"{part}_{name}\""));
        }
    }
    gmsh(&groups, &nodes, &elements)
}

const TWO_BLOCKS: &str = r#"
schema = 1
name = "two blocks"
geometry = { plane_strain = { depth = "10 mm" } }
mesh = { file = "mesh.msh", unit = "1 mm" }

[[material]]
regions = ["lower_body", "upper_body"]
law = { neo_hookean = { shear_modulus = "100 kPa" } }
compressibility = "incompressible"

[[parameter]]
name = "way"
values = ["-4 mm"]

[[support]]
on = "lower_bottom"
held = ["y"]

[[support]]
on = "lower_left"
held = ["x"]

[[support]]
on = "upper_left"
held = ["x"]

[[support]]
on = "upper_top"
moved = { by = "way", y = 1 }

[output]
reactions = ["lower_bottom"]

"#;
const TOUCHING: &str =
    "[[contact]]\nname = \"joint\"\nsurfaces = [\"upper_bottom\", \"lower_top\"]\nfriction = 0\n";
const TIED: &str = "[[tie]]\nsurfaces = [\"upper_bottom\", \"lower_top\"]\n";

#[test]
fn two_blocks_press_each_other_as_one_and_pull_as_one_where_they_are_tied() {
    let mesh = two_blocks([3, 4]);
    // Plane strain: G (l - l^-3) on 10 mm by 10 mm.
    let force = |stretch: f64| 100e3 * (stretch - stretch.powi(-3)) * 1e-4;
    let pressed = solved(&format!("{TWO_BLOCKS}{TOUCHING}"), mesh.as_bytes());
    let joint = column(&pressed, "joint_force_y")[1];
    let base = column(&pressed, "lower_bottom_reaction_y")[1];
    let exact = force(0.8);
    // Two blocks of 10 mm become 16 mm. The overlap that is accepted is 1e-4 of a cell.
    assert!((base / -exact - 1.0).abs() < 2e-4, "{base} {exact}");
    assert!((joint / base - 1.0).abs() < 1e-6, "{joint} {base}");
    let area = column(&pressed, "joint_contact_area")[1];
    assert!((area - 1e-4).abs() < 1e-12, "{area}");
    // As wide as the blocks have become, within the overlap that is accepted, and pressed evenly.
    let deformed = column(&pressed, "joint_deformed_contact_area")[1];
    assert!((deformed * 0.8 / 1e-4 - 1.0).abs() < 2e-4, "{deformed}");
    let pressure = column(&pressed, "joint_greatest_pressure")[1];
    assert!(
        (pressure * deformed / joint.abs() - 1.0).abs() < 1e-3,
        "{pressure} {deformed} {joint}"
    );
    assert!(pressed.vtu().unwrap().contains("contact_pressure_pa"));
    // The nodes at one place where the blocks touch are meant.
    assert_eq!(pressed.notes(), [""; 0]);

    let pull = TWO_BLOCKS.replace("-4 mm", "4 mm");
    let tied = solved(&format!("{pull}{TIED}"), mesh.as_bytes());
    let base = column(&tied, "lower_bottom_reaction_y")[1];
    let exact = force(1.2);
    assert!((base / -exact - 1.0).abs() < 1e-5, "{base} {exact}");

    // Without either nothing holds the upper block; a tie needs something to be tied to.
    let refused = |text: &str| match body("problem.toml", text, mesh.as_bytes()) {
        Ok(_) => panic!("{text} was accepted"),
        Err(error) => error.to_string(),
    };
    let loose = TWO_BLOCKS.replace("[[support]]\non = \"upper_left\"\nheld = [\"x\"]\n", "");
    assert!(refused(&loose).contains("lie on each other"));
    let away = TIED.replace("lower_top", "lower_bottom");
    let message = refused(&format!("{TWO_BLOCKS}{away}"));
    for part in [
        "tie.0.surfaces",
        "nothing to be tied to",
        "finer surface first",
    ] {
        assert!(message.contains(part), "{message}");
    }
    // Neither field nor current is solved from one mesh to the other.
    let field = "[capacitance]\nelectrodes = [\"upper_top\", \"lower_bottom\"]\n\
                 [[capacitance.dielectric]]\nregions = [\"lower_body\", \"upper_body\"]\npermittivity = 3\n";
    let message = refused(&format!("{TWO_BLOCKS}{TIED}{field}"));
    for part in [
        "tie.0.surfaces",
        "does not pass a tie",
        "mesh the two parts as one",
    ] {
        assert!(message.contains(part), "{message}");
    }
    let message = refused(&format!("{TWO_BLOCKS}{TOUCHING}{field}"));
    for part in [
        "capacitance.electrodes.0",
        "no dielectric leads from \"upper_top\"",
    ] {
        assert!(message.contains(part), "{message}");
    }
    // Each electrode has its own partner.
    let field = field.replace(
        "\"upper_top\", \"lower_bottom\"",
        "\"upper_top\", \"upper_bottom\", \"lower_top\", \"lower_bottom\"",
    );
    let text = format!("{TWO_BLOCKS}{TOUCHING}{field}");
    let touching = body("problem.toml", &text, mesh.as_bytes()).unwrap();
    let [across] = column(&touching, "capacitance_upper_top_lower_bottom")[..] else {
        panic!("one row");
    };
    assert!(across == 0.0 && across.is_sign_positive(), "{across}");
    // Both surfaces of the contact are electrodes: the field is meant to end there.
    let stopped = |note: &&String| note.contains("does not pass it");
    assert_eq!(touching.notes().iter().find(stopped), None);
    let current = "[[resistance]]\nname = \"r\"\nfrom = \"upper_top\"\nto = \"lower_bottom\"\n\
                   conductor = [{ regions = [\"lower_body\", \"upper_body\"], resistivity = \"1 ohm m\" }]\n";
    let message = refused(&format!("{TWO_BLOCKS}{TOUCHING}{current}"));
    for part in [
        "resistance.0.conductor",
        "from \"upper_top\" to \"lower_bottom\"",
    ] {
        assert!(message.contains(part), "{message}");
    }
    // A lower block that is driven through the upper one is no equilibrium.
    let driven = TWO_BLOCKS.replace("moved = { by = \"way\", y = 1 }", "held = [\"y\"]");
    let driven = format!(
        "{driven}[[support]]\non = \"lower_top\"\nmoved = {{ by = \"way\", y = -1 }}\n{TOUCHING}"
    )
    .replace("upper_top", "upper_bottom");
    let mut driven = body("problem.toml", &driven, mesh.as_bytes()).unwrap();
    let failure = driven.step(|_| true).unwrap_err();
    let message = driven.explain(&failure);
    for part in ["overlaps by", "contact \"joint\""] {
        assert!(message.contains(part), "{message}");
    }
    let unknown = TOUCHING.replace("lower_top", "lower_tip");
    let message = refused(&format!("{TWO_BLOCKS}{unknown}"));
    for part in ["contact.0.surfaces.1", "lower_top"] {
        assert!(message.contains(part), "{message}");
    }
}

/// A ball that is drawn deep inside the body is the cause, and not the iteration.
#[test]
fn a_ball_drawn_inside_the_body_is_named_as_the_cause() {
    let (text, mesh) = shipped("fingertip");
    let plane = "plane = { point = [\"0 mm\", \"0 mm\", \"-7 mm\"], normal = [0, 0, 1] }";
    let ball = "sphere = { centre = [\"0 mm\", \"0 mm\", \"-8 mm\"], radius = \"2 mm\" }";
    assert!(text.contains(plane));
    let text = text.replace(plane, ball);
    let text = text.replace("friction = 0.3", "friction = 0");
    let mut body = body("problem.toml", &text, mesh).unwrap();
    let noted = |note: &String| note.contains("overlaps by 0.99");
    assert!(body.notes().iter().any(noted), "{:?}", body.notes());
    let failure = body.step(|_| true).unwrap_err();
    let message = body.explain(&failure);
    for part in ["\"plate\" overlaps by 0.99", "where it just touches"] {
        assert!(message.contains(part), "{message}");
    }
}

/// The facet on which a rough contact is held comes from a file that may be damaged.
#[test]
fn a_saved_state_that_names_a_facet_beyond_its_surface_is_refused() {
    let mesh = two_blocks([3, 4]);
    let rough = TOUCHING.replace("friction = 0", "friction = 0.3");
    let problem = format!("{TWO_BLOCKS}{rough}");
    let mut body = body("problem.toml", &problem, mesh.as_bytes()).unwrap();
    assert_eq!(body.step(|_| true).unwrap(), Ended::Done);
    let saved = body.save("same");
    body.restore(&saved, "same").unwrap();
    let mut damaged: serde_json::Value = serde_json::from_str(&saved).unwrap();
    let anchors = damaged["anchors"][0].as_str().unwrap().to_owned();
    // A facet is written as two more than its number; the second surface has three.
    let bits = |number: f64| format!("{:016x}", number.to_bits());
    let (held, rest) = anchors.split_at(16);
    assert!(
        (2..5).any(|number| held == bits(f64::from(number))),
        "{held}"
    );
    damaged["anchors"][0] = format!("{}{rest}", bits(5.0)).into();
    let error = body.restore(&damaged.to_string(), "same").unwrap_err();
    let message = error.to_string();
    assert!(message.contains("facet 3 of a surface of 3"), "{message}");
}

/// A square of 2 mm with its four sides and two of its corners named: MSH 2.2.
const SQUARE: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n\
$PhysicalNames\n7\n0 6 \"lower\"\n0 7 \"upper\"\n1 1 \"base\"\n1 2 \"right\"\n1 3 \"top\"\n\
1 4 \"left\"\n2 5 \"rubber\"\n$EndPhysicalNames\n\
$Nodes\n4\n1 0 0 0\n2 2 0 0\n3 2 2 0\n4 0 2 0\n$EndNodes\n\
$Elements\n7\n1 1 2 1 1 1 2\n2 1 2 2 2 2 3\n3 1 2 3 3 3 4\n4 1 2 4 4 4 1\n5 3 2 5 1 1 2 3 4\n\
6 15 2 6 1 1\n7 15 2 7 1 3\n$EndElements\n";

#[test]
fn a_periodic_cell_is_stretched_as_the_solid_says() {
    let text = r#"
schema = 1
name = "periodic cell"
geometry = { plane_strain = { depth = "5 mm" } }
mesh = { file = "square.msh", unit = "1 mm" }

[[material]]
regions = ["rubber"]
law = { neo_hookean = { shear_modulus = "100 kPa" } }
compressibility = "incompressible"

[[parameter]]
name = "pull"
values = ["0.2 mm", "0.4 mm"]

[[parameter]]
name = "aside"
values = ["0 N", "0 N"]
prescribes = "force"

[[support]]
on = "lower"
held = ["x", "y"]

[[constraint]]
periodic = ["left", "right"]
moved = { by = "pull", x = 1 }

[[constraint]]
periodic = ["base", "top"]
moved = { by = "aside", y = 1 }

[output]
displacements = ["upper"]
reactions = ["right"]
"#;
    let body = solved(text, SQUARE.as_bytes());
    let stretch: f64 = 1.2;
    let found = column(&body, "aside_found")[2];
    assert!(
        (found - 2e-3 * (1.0 / stretch - 1.0)).abs() < 1e-12,
        "{found}"
    );
    let moved = column(&body, "upper_displacement_x")[2];
    assert!((moved - 0.4e-3).abs() < 1e-15, "{moved}");
    // The side that follows carries the force: but for the share of its corners.
    let force = column(&body, "right_reaction_x")[2];
    let nominal = 100e3 * (stretch - stretch.powi(-3)) * 2e-3 * 5e-3;
    assert!((force / nominal - 1.0).abs() < 1e-6, "{force} {nominal}");
    // One that is said another way as well.
    let twice = "[[constraint]]\npoint = { at = \"upper\", along = \"x\" }\n\
                 follows = [{ at = \"lower\", along = \"y\", factor = 0.5 }]\n\n[output]";
    let error = match self::body(
        "square.toml",
        &text.replace("[output]", twice),
        SQUARE.as_bytes(),
    ) {
        Ok(_) => panic!("not refused"),
        Err(error) => error.to_string(),
    };
    for part in ["constraint.2.point", "contradicts", "^^^"] {
        assert!(error.contains(part), "{part}: {error}");
    }
    // The top on the mean, in place of its period.
    let mean = text
        .replace("periodic = [\"base\", \"top\"]", "mean = { on = \"top\", along = \"y\" }")
        .replace("periodic = [\"left\", \"right\"]", "mean = { on = \"right\", along = \"x\" }")
        .replace(
            "[[support]]\n",
            "[[support]]\non = \"left\"\nheld = [\"x\"]\n\n[[support]]\non = \"base\"\nheld = [\"y\"]\n\n[[support]]\n",
        );
    let body = solved(&mean, SQUARE.as_bytes());
    let found = column(&body, "aside_found")[2];
    assert!(
        (found - 2e-3 * (1.0 / stretch - 1.0)).abs() < 1e-12,
        "{found}"
    );
}

#[test]
fn a_rigid_side_turns_its_body_and_tells_force_and_torque() {
    // In the plane of x and z a turn about y takes what is below the point to -x.
    let (_, mesh) = shipped("fingertip");
    let text = r#"
schema = 1
name = "turned fingertip"
geometry = { plane_strain = { depth = "15 mm" } }
mesh = { file = "fingertip.msh", unit = "1 mm" }

[[material]]
regions = ["skin", "pulp"]
law = { neo_hookean = { shear_modulus = "15 kPa" } }
compressibility = { quadratic = { bulk_modulus = "0.75 MPa" } }

[[parameter]]
name = "angle"
values = ["30 deg"]

[[rigid]]
name = "bone"
on = "bone"
point = ["0 mm", "0 mm", "0 mm"]
held = ["x", "z"]
turned = { by = "angle", y = 1 }

[output]
displacements = ["tip"]
"#;
    let body = solved(text, mesh);
    let tip = ["x", "z"].map(|axis| column(&body, &format!("tip_displacement_{axis}"))[1]);
    assert!((tip[0] + 3.5e-3).abs() < 1e-9, "{tip:?}");
    assert!(
        (tip[1] - 7e-3 * (1.0 - 0.75_f64.sqrt())).abs() < 1e-9,
        "{tip:?}"
    );
    assert!((column(&body, "bone_turn_y")[1] - 30_f64.to_radians()).abs() < 1e-12);
    assert!(column(&body, "bone_torque_y")[1].abs() < 1e-9);
    // By a torque against a nail that holds: the torque is that of the parameter.
    let text = text
        .replace(
            "values = [\"30 deg\"]",
            "values = [\"0.5 mN m\"]\nprescribes = \"torque\"",
        )
        .replace(
            "[output]",
            "[[support]]\non = \"outside\"\nheld = [\"x\", \"z\"]\n\n[output]",
        );
    let body = solved(&text, mesh);
    let torque = column(&body, "bone_torque_y")[1];
    let angle = column(&body, "angle_found")[1];
    assert!((torque / 0.5e-3 - 1.0).abs() < 1e-6, "{torque}");
    assert!((column(&body, "bone_turn_y")[1] - angle).abs() < 1e-12);
    assert!(angle > 1e-3 && angle < 0.5, "{angle}");
}

#[test]
fn a_soft_fingertip_takes_a_soft_pad_along() {
    let (text, mesh) = shipped("pad");
    // Pressed, and carried over the first millimetre.
    let values = [
        "\"0.5 mm\", \"1 mm\", \"1.5 mm\", \"1.5 mm\", \"1.5 mm\", \"1.5 mm\"",
        "\"0 mm\", \"0 mm\", \"0 mm\", \"0.5 mm\", \"1 mm\", \"2 mm\"",
    ];
    assert!(values.iter().all(|values| text.contains(values)));
    let text = text
        .replace(values[0], "\"1 mm\", \"1 mm\"")
        .replace(values[1], "\"0 mm\", \"0.5 mm\"");
    let body = solved(&text, mesh);
    let [along, press] = ["x", "y"].map(|axis| column(&body, &format!("touch_force_{axis}")));
    let base = ["x", "y"].map(|axis| column(&body, &format!("pad_base_reaction_{axis}")));
    // The pad is in balance between the fingertip and its base.
    for (base, touch) in base.iter().zip([&along, &press]) {
        assert!(
            (base[2] / touch[2] - 1.0).abs() < 1e-9,
            "{base:?} {touch:?}"
        );
    }
    // Without a way aside there is no pull; with it the contact sticks over the most part.
    assert!(along[1].abs() < 1e-3 * press[1], "{along:?}");
    let share = -along[2] / press[2];
    assert!(share > 0.05 && share < 0.5, "{share}");
}

#[test]
fn a_dome_under_a_rough_plate_goes_down_to_its_end_with_default_settings() {
    let (text, mesh) = shipped("dome");
    let rough = text
        .replacen("friction = 0\n", "friction = 0.5\n", 1)
        .replacen("\"1.5 mm\"]", "\"1.5 mm\", \"1.8 mm\"]", 1);
    let forces = |text: &str| column(&solved(text, mesh), "plate_force_y");
    let (smooth, rough) = (forces(text), forces(&rough));
    assert_eq!(rough.len(), 8);
    // Friction holds the top together: stiffer, by a few per cent.
    let more = rough[6] / smooth[6];
    assert!(more > 1.01 && more < 1.05, "{more}");
    assert!(rough[7] < -4.5 && rough[7] > -4.7, "{}", rough[7]);
}

/// A square of 2 mm whose top is moved down, on its base.
const PRESSED: &str = r#"
schema = 1
name = "pressed square"
geometry = { plane_strain = { depth = "5 mm" } }
mesh = { file = "mesh.msh", unit = "1 mm" }

[[material]]
regions = ["rubber"]
law = { neo_hookean = { shear_modulus = "100 kPa" } }
compressibility = { quadratic = { bulk_modulus = "1 MPa" } }

[[parameter]]
name = "way"
values = ["-0.2 mm"]

[[support]]
on = "base"
held = ["x", "y"]

[[support]]
on = "top"
moved = { by = "way", y = 1 }

[output]
reactions = ["base"]
"#;

/// Two of the squares on each other, with the line between them named `middle`.
fn tower() -> String {
    SQUARE
        .replace("PhysicalNames\n7", "PhysicalNames\n8\n1 8 \"middle\"")
        .replace("Nodes\n4\n", "Nodes\n6\n5 0 4 0\n6 2 4 0\n")
        .replace(
            "Elements\n7\n",
            "Elements\n9\n8 1 2 8 3 3 4\n9 3 2 5 1 4 3 6 5\n",
        )
        .replace("3 1 2 3 3 3 4\n", "3 1 2 3 3 6 5\n")
}

const WALL: &str = "[[obstacle]]\nname = \"wall\"\nsurface = \"right\"\nfriction = 0\n\
                    shape = { plane = { point = [\"9 mm\", \"0 mm\", \"0 mm\"], normal = [-1, 0, 0] } }\n";

/// What is added to the problem and what is replaced in it, and what its message must have.
type Odd<'a> = (&'a str, [&'a str; 2], &'a [&'a str]);

#[test]
fn odd_problems_are_refused_under_the_word() {
    let refused = |(more, [from, to], parts): Odd<'_>, mesh: &str| {
        let text = format!("{PRESSED}{more}");
        assert!(text.contains(from), "{from}");
        let text = text.replacen(from, to, 1);
        let message = match body("problem.toml", &text, mesh.as_bytes()) {
            Ok(_) => panic!("not refused: {more} {to}"),
            Err(error) => error.to_string(),
        };
        for part in parts {
            assert!(message.contains(part), "{part} is not in\n{message}");
        }
    };
    let same = ["", ""];
    let volume = "[[parameter]]\nname = \"air\"\nvalues = [\"0 mm3\"]\n\
                  prescribes = { volume = { of = \"room\" } }\n\
                  [[cavity]]\nname = \"room\"\nwall = [\"top\"]\npressure = \"air\"\n";
    let floor = WALL.replace("wall", "floor").replace("right", "base");
    let under = floor.replace("\"9 mm\", \"0 mm\"", "\"0 mm\", \"-1 mm\"");
    let under = under.replace("[-1, 0, 0]", "[0, 1, 0]");
    let risen = format!("{under}moved = {{ by = \"way\", y = -10 }}\n");
    let above = under.replace("-1 mm", "1 mm");
    let squares: [Odd<'_>; 15] = [
        (
            &risen,
            same,
            &[
                "obstacle.0.moved",
                "\"floor\" is 1.0000 mm deep in \"base\" near (1.0000, 0.0000, 0.0000) mm at the end of step 1",
            ],
        ),
        (
            &above,
            same,
            &["obstacle.0.shape", "1.0000 mm deep", "at rest"],
        ),
        (
            "[[cavity]]\nname = \"room\"\nwall = [\"base\"]\n",
            same,
            &["cavity.0.wall", "no volume at rest", "a little open"],
        ),
        (
            "",
            ["-0.2 mm", "nan mm"],
            &["\"nan mm\" is not a finite number"],
        ),
        ("", ["-0.2 mm", "-inf mm"], &["\"-inf mm\" is not a finite"]),
        ("", ["100 kPa", "1e999 kPa"], &["is not a finite number"]),
        (
            "",
            ["y = 1", "y = 1e300"],
            &["support.1.moved.y", "1e300 is out"],
        ),
        (
            "[solver]\nfirst_part = 0.01\nsmallest_part = 0.5\n",
            same,
            &["solver.smallest_part", "0.5 is more than first_part"],
        ),
        (
            "[[support]]\non = \"left\"\nmoved = { by = \"way\", y = 2 }\n",
            same,
            &[
                "support.2.on",
                "contradict",
                "at (0, 0, 0): it is",
                "driven by 2 times",
                "(lengths in mm)",
            ],
        ),
        (
            WALL,
            ["friction = 0\n", "friction = 0\noverlap = \"3 mm\"\n"],
            &["obstacle.0.overlap", "mean side", "2.0000 mm"],
        ),
        (
            TOUCHING,
            [
                "[\"upper_bottom\", \"lower_top\"]",
                "[\"right\", \"base\"]\noverlap = \"3 mm\"",
            ],
            &["contact.0.overlap", "2.0000 mm"],
        ),
        (volume, same, &["cavity.0.wall", "volume at rest"]),
        (
            "",
            [
                "[[support]]\non = \"top\"\nmoved",
                "[[support]]\non = \"rubber\"\nmoved",
            ],
            &["support.1.on", "no surface, curve or point"],
        ),
        (
            "[[load]]\non = \"rubber\"\npressure = \"way\"\n",
            same,
            &["load.0.on", "no surface \"rubber\""],
        ),
        (
            "[picture]\nfrom = [0, 0, 0]\n",
            same,
            &["picture.from", "the direction is zero"],
        ),
    ];
    for odd in squares {
        refused(odd, SQUARE);
    }
    // Over a plane of symmetry.
    let lifted = SQUARE.replace("1 0 0 0\n2 2 0 0\n", "1 0 1 0\n2 2 1 0\n");
    let below = volume.replace("\"top\"", "\"base\"");
    let odd: Odd<'_> = (&below, same, &["parameter.1.values.0", "volume above 0"]);
    refused(odd, &lifted);
    // A base that rises from where the volume below it is measured.
    let rising = SQUARE.replace("2 2 0 0\n", "2 2 1 0\n");
    let odd: Odd<'_> = (
        "[[cavity]]\nname = \"room\"\nwall = [\"base\"]\n",
        [
            "held = [\"x\", \"y\"]",
            "held = [\"x\"]\nmoved = { by = \"way\", y = 1 }",
        ],
        &[
            "cavity.0",
            "open across y, and the support of \"base\" moves",
        ],
    );
    refused(odd, &rising);
    // What lies between cells has no outside.
    let tower = tower();
    let wall = WALL.replace("right", "middle");
    let between: [Odd<'_>; 4] = [
        (
            "[[parameter]]\nname = \"p\"\nvalues = [\"1 kPa\"]\n\
             [[load]]\non = \"middle\"\npressure = \"p\"\n",
            same,
            &[
                "load.0.on",
                "\"middle\" lies inside the body near (1.0000, 2.0000",
            ],
        ),
        (&wall, same, &["obstacle.0.surface", "inside the body"]),
        (
            TOUCHING,
            [
                "[\"upper_bottom\", \"lower_top\"]",
                "[\"right\", \"middle\"]",
            ],
            &["contact.0.surfaces.1", "inside the body"],
        ),
        (
            "[[cavity]]\nname = \"room\"\nwall = [\"middle\"]\n",
            same,
            &["cavity.0.wall.0", "inside the body"],
        ),
    ];
    for odd in between {
        refused(odd, &tower);
    }
    // Two nodes at one place part the bodies.
    let parted = tower
        .replace("Nodes\n6\n", "Nodes\n8\n7 0 2 0\n8 2 2 0\n")
        .replace("4 3 6 5\n", "7 8 6 5\n");
    refused(
        (
            "",
            [
                "[[support]]\non = \"top\"\nmoved = { by = \"way\", y = 1 }",
                "[[support]]\non = \"upper\"\nmoved = { by = \"way\", y = 1 }",
            ],
            &[
                "mesh.file",
                "lie on each other near (1.0000, 2.0000",
                "[[tie]]",
            ],
        ),
        &parted,
    );
    // A contact of two surfaces that are partly one.
    let more = SQUARE
        .replace("PhysicalNames\n7", "PhysicalNames\n8\n1 8 \"sides\"")
        .replace(
            "Elements\n7\n",
            "Elements\n9\n8 1 2 8 2 2 3\n9 1 2 8 4 4 1\n",
        );
    refused(
        (
            TOUCHING,
            [
                "[\"upper_bottom\", \"lower_top\"]",
                "[\"right\", \"sides\"]",
            ],
            &["contact.0.surfaces", "a part in common"],
        ),
        &more,
    );
}

#[test]
fn odd_problems_are_noted() {
    let notes = |text: &str, mesh: &str| -> Vec<String> {
        body("problem.toml", text, mesh.as_bytes())
            .unwrap()
            .notes()
            .to_vec()
    };
    assert_eq!(notes(PRESSED, SQUARE), [""; 0]);
    // Two bodies that begin in touch, at a node of each.
    let (pad, mesh) = shipped("pad");
    let touching = |text: &str| body("pad.toml", text, mesh).unwrap().notes().to_vec();
    assert_eq!(touching(pad), [""; 0]);
    let start = pad.find("[[contact]]").unwrap();
    let end = pad.find("[output]").unwrap();
    let [note] = &touching(&format!("{}{}", &pad[..start], &pad[end..]))[..] else {
        panic!();
    };
    assert!(note.contains("nodes 757 and 1577 both lie at"), "{note}");
    let metres = PRESSED.replace("unit = \"1 mm\"", "unit = \"10 m\"");
    let [note] = &notes(&metres, SQUARE)[..] else {
        panic!();
    };
    assert!(note.contains("2.000e4 mm long"), "{note}");
    let touching = TOUCHING.replace("\"upper_bottom\", \"lower_top\"", "\"right\", \"top\"");
    let [note] = &notes(&format!("{PRESSED}{touching}"), SQUARE)[..] else {
        panic!();
    };
    assert!(
        note.contains("\"right\" and \"top\" share 1 node") && note.contains("(2.0000, 2.0000"),
        "{note}"
    );
    // A ball that turns about an axis beside it.
    let round = PRESSED.replace(
        "{ plane_strain = { depth = \"5 mm\" } }",
        "\"axisymmetric\"",
    );
    let ball = WALL.replace(
        "plane = { point = [\"9 mm\", \"0 mm\", \"0 mm\"], normal = [-1, 0, 0] }",
        "sphere = { centre = [\"9 mm\", \"1 mm\", \"0 mm\"], radius = \"1 mm\" }",
    );
    let [note] = &notes(&format!("{round}{ball}"), SQUARE)[..] else {
        panic!();
    };
    assert!(
        note.contains("9.0000 mm off the axis of revolution, so it is a ring"),
        "{note}"
    );
    // A law of small strain.
    let strained = |way: &str| {
        let text = PRESSED
            .replace(
                "{ neo_hookean = { shear_modulus = \"100 kPa\" } }",
                "{ linear_elastic = { young_modulus = \"200 kPa\", poisson_ratio = 0.3 } }",
            )
            .replace(
                "compressibility = { quadratic = { bulk_modulus = \"1 MPa\" } }\n",
                "",
            )
            .replace("-0.2 mm", way);
        solved(&text, SQUARE.as_bytes()).beyond_small_strain()
    };
    assert_eq!(strained("-0.01 mm"), None);
    let note = strained("-0.4 mm").unwrap();
    assert!(
        note.contains("after step 1 \"rubber\" is strained by -")
            && note.contains(" mm: linear_elastic"),
        "{note}"
    );
    // A gap under a lifted base, down to where its volume is measured from.
    let room = "[[cavity]]\nname = \"room\"\nwall = [\"base\"]\n";
    let lifted = SQUARE.replace(
        "1 0 0 0\n2 2 0 0\n3 2 2 0\n4 0 2 0\n",
        "1 0 3 0\n2 2 3 0\n3 2 5 0\n4 0 5 0\n",
    );
    let [note] = &notes(&format!("{PRESSED}{room}"), &lifted)[..] else {
        panic!();
    };
    assert!(note.contains("measured from y = 0"), "{note}");
    // Two squares that meet in a corner.
    let corner = SQUARE
        .replace("Nodes\n4\n", "Nodes\n7\n5 4 2 0\n6 4 4 0\n7 2 4 0\n")
        .replace("Elements\n7\n", "Elements\n8\n8 3 2 5 1 3 5 6 7\n");
    let [note] = &notes(PRESSED, &corner)[..] else {
        panic!();
    };
    assert!(
        note.contains("(2.0000, 2.0000, 0.0000) mm without a side"),
        "{note}"
    );
    // A side that the file has twice carries its pressure once.
    let force = |mesh: &str| {
        let load = "[[parameter]]\nname = \"p\"\nvalues = [\"10 kPa\"]\n\
                    [[load]]\non = \"top\"\npressure = \"p\"\n";
        let text = PRESSED.replace(
            "[[support]]\non = \"top\"\nmoved = { by = \"way\", y = 1 }\n",
            "",
        );
        let text = text.replace(
            "[[parameter]]\nname = \"way\"\nvalues = [\"-0.2 mm\"]\n",
            "",
        );
        column(
            &solved(&format!("{text}{load}"), mesh.as_bytes()),
            "base_reaction_y",
        )[1]
    };
    let twice = SQUARE.replace("Elements\n7\n", "Elements\n8\n8 1 2 3 3 4 3\n");
    assert_eq!(force(SQUARE).to_bits(), force(&twice).to_bits());
    // An obstacle that is far away.
    let body = solved(&format!("{PRESSED}{WALL}"), SQUARE.as_bytes());
    assert_eq!(body.untouched(), ["wall"]);
    let near = WALL.replace("9 mm", "2 mm");
    let body = solved(&format!("{PRESSED}{near}"), SQUARE.as_bytes());
    assert_eq!(body.untouched(), [""; 0]);
    // One that is touched on the way to a failure, though not at the end of a step: a stop in the
    // first part of the step.
    let coming = format!("{PRESSED}{}", near.replace("2 mm", "2.001 mm"));
    let coming = coming.replace("[\"-0.2 mm\"]", "[\"0 mm\", \"-0.2 mm\"]");
    let mut body = self::body("problem.toml", &coming, SQUARE.as_bytes()).unwrap();
    assert_eq!(body.step(|_| true).unwrap(), Ended::Done);
    assert_eq!(body.untouched(), ["wall"]);
    assert_eq!(body.step(|part| part < 0.5).unwrap(), Ended::Stopped);
    assert_eq!(body.untouched(), [""; 0]);
}
