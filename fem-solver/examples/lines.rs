//! What form finding of a long barrier costs: `lines [FIELDS [DEGREES [rings|wire|square [FRICTION]]]]`, fields of 10 m, lean of the posts.
//! What was measured stands in `README.md` beside this. With `--scene` at the end it prints the scene alone.

use fem_solver::config::Config;
use fem_solver::config::structure::FormFinding;
use fem_solver::equilibrium::form_finding::{Wanted, fallen, find_form};
use fem_solver::equilibrium::newton::Newton;
use fem_solver::model::Model;
use std::time::Instant;
use toolkit::scene::Scene;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize, or: f64| args.get(i).and_then(|x| x.parse().ok()).unwrap_or(or);
    let (fields, lean, net) = (number(0, 8.0), number(1, 25.0), args.get(2).map_or("rings", String::as_str));
    let text = scene(fields as usize, lean, net, number(3, 0.0));
    if args.last().is_some_and(|last| last == "--scene") {
        print!("{text}");
        return;
    }
    let scene = Scene::from_text("line.toml", &text).unwrap_or_else(|e| panic!("{e}"));
    let config = Config::of(&scene).unwrap_or_else(|e| panic!("{e}"));
    let model = Model::build(&scene, &config).unwrap_or_else(|e| panic!("{e}"));
    let start = Instant::now();
    let mut newton = Newton::new(&model);
    let wanted = Wanted { model: &model, method: FormFinding::Static, most: None, basis: None };
    let mut iterations = 0;
    let found = find_form(wanted, &mut newton, &mut |_, _| {
        iterations += 1;
        Ok(())
    });
    let (took, free) = (start.elapsed().as_secs_f64(), newton.tangent.dofs.len());
    let factor = newton.tangent.matrix.cholesky.factor_len();
    let outcome = match found {
        Ok((form, _)) => match fallen(&model, &form.displacement) {
            Some((_, angle)) => format!("a post has fallen, by {angle:.0} degrees"),
            None => "stands".to_owned(),
        },
        Err(why) => why.describe(&model),
    };
    println!(
        "{net}, {fields} fields, {lean} degrees: {free} unknowns, {factor} numbers, {iterations} iterations, {took:.2} s; {outcome}"
    );
}

/// A barrier of `fields` of 10 m.
fn scene(fields: usize, degrees: f64, net: &str, friction: f64) -> String {
    let cell = 0.5;
    let rope = |name: &str| {
        format!(
            "[[structure.parts]]\nname = \"{name}\"\nelement = \"sliding_cable\"\nyoung = 1e11\narea = 2.4e-4\n\
             density = 7850.0\nprestress = 5e7\nfriction = {friction:?}\n"
        )
    };
    let brake = |name: &str, force: f64| {
        format!(
            "[[structure.parts]]\nname = \"{name}\"\nelement = \"brake\"\nstiffness = 5e6\n\
             curve = [[0.03, {force:?}], [1.6, {:?}]]\nstroke = 1.4\nmass = 15.0\n",
            1.2 * force
        )
    };
    let part = match net {
        "wire" => format!(
            "element = \"wire_ring\"\nturns = 12\nwire_diameter = 3e-3\ndiameter = {:?}\nstrength = 1.77e9",
            0.92 * cell
        ),
        "square" => "element = \"cable\"\narea = 2.5e-5\nprestress = 2e6".to_owned(),
        _ => format!(
            "element = \"ring\"\ndiameter = {cell:?}\nperimeter = {:?}\nperimeter_stiffness = 8e6\nbending_stiffness = 1e5\nmass = {:?}",
            2.82 * cell,
            1.89 * cell
        ),
    };
    format!(
        r#"
end_time = 0.5
gravity = [0.0, 0.0, -9.81]
[structure]
form_finding = "static"
supports = [{{ group = "feet", rotations = "z" }}, {{ group = "anchors" }}]
[structure.generator]
type = "barrier"
fields = {fields}
height = 4.0
side_distance = 7.0
net = {:?}
cells = [20, 8]
lean = {:?}
[structure.cable]
young = 1e11
area = 2.4e-4
density = 7850.0
{}{}{}{}
[[structure.parts]]
name = "net"
{part}
[[structure.parts]]
name = "side_ropes"
element = "cable"
prestress = 5e7
[[structure.parts]]
name = "posts"
element = "beam"
young = 2.1e11
area = 5.4e-3
inertia = [2.5e-5, 9e-6]
torsion = 3e-7
density = 7850.0
"#,
        if net == "square" { "square" } else { "rings" },
        4.0 * f64::to_radians(degrees).sin(),
        rope("top_rope"),
        rope("bottom_rope"),
        brake("rope_brakes", 1.2e5),
        brake("upslope_brakes", 7e4),
    )
}
