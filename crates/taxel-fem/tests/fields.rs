//! scratch
use std::time::Instant;
use taxel_fem::field::cases::*;

#[test]
fn scratch() {
    for level in 1..=3 {
        for gap in [20.0, 50.0, 100.0] {
            for (name, above, below) in [
                ("uniform", 2.4, Some(2.4)),
                ("air_above", 1.0, Some(2.4)),
                ("glass", 1.0, Some(5.5)),
                ("air both", 1.0, Some(1.0)),
                ("grounded", 1.0, None),
                ("grounded uniform", 2.4, None),
            ] {
                let t = Instant::now();
                let x = bars_above_base(
                    Bars {
                        gap,
                        width: 1000.0,
                        thickness: 100.0,
                        height: 550.0,
                        layer: 950.0,
                    },
                    Surroundings {
                        layer: 2.4,
                        above,
                        below,
                    },
                    level,
                )
                .unwrap();
                println!(
                    "{level} {gap} {name} {:.4} {:.4} {} {:?}",
                    x.0,
                    x.1,
                    x.2,
                    t.elapsed()
                );
            }
        }
        if level < 3 {
            let t = Instant::now();
            let x = cube(level).unwrap();
            println!(
                "{level} {} {} {:.2e} {} {:?}",
                x.name,
                x.ours,
                x.error(),
                x.cells,
                t.elapsed()
            );
        }
    }
}
