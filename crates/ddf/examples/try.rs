//! Scratch.
use halflight_ddf::*;
use std::time::Instant;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let seconds: f64 = args[2].parse().expect("seconds");
    let model = halflight_shape::load_model(args[1].as_ref()).expect("mesh");
    let mesh = model.rest_surface().mesh;
    let mut o = TrainOptions::default();
    for a in &args[3..] {
        let (k, v) = a.split_once('=').expect("k=v");
        match k {
            "r" => o.shape.resolution = v.parse().expect("n"),
            "l" => o.shape.levels = v.split(',').map(|x| x.parse().expect("n")).collect(),
            "f" => o.shape.features = v.parse().expect("n"),
            "p" => o.shape.points = v.parse().expect("n"),
            "h" => o.shape.hidden = v.parse().expect("n"),
            "n" => o.shape.layers = v.parse().expect("n"),
            "m" => o.shape.margin = v.parse().expect("n"),
            "b" => o.shape.roundness = v.parse().expect("n"),
            "lines" => o.lines_per_step = v.parse().expect("n"),
            "fr" => o.feature_rate = v.parse().expect("n"),
            "nr" => o.network_rate = v.parse().expect("n"),
            "dw" => o.distance_weight = v.parse().expect("n"),
            _ => panic!("{k}"),
        }
    }
    let t = Instant::now();
    let mut tr = FastTrainer::new(&mesh, o).expect("trainer");
    println!("prepared {:.2} s", t.elapsed().as_secs_f64());
    let start = Instant::now();
    let mut samples = 0;
    let mut next = 0.0;
    loop {
        let p = start.elapsed().as_secs_f64() / seconds;
        if p >= 1.0 { break; }
        let r = tr.step(p as f32).expect("step");
        samples += r.samples;
        if p >= next {
            println!("{:5.1} s step {} vis {:.4} wrong {:.4} dist {:.4}", p * seconds, tr.steps_done(), r.visibility_loss, r.wrong, r.distance_loss);
            next += 0.2;
        }
    }
    println!("{} steps, {:.2} M samples/s", tr.steps_done(), samples as f64 / seconds * 1e-6);
    let field = tr.field();
    println!("cells {} params {} memory {} kB", field.occupied_cells(), field.parameters(), field.memory_bytes() / 1000);
    let e = evaluate(&field, tr.unit_mesh(), 30000, 7);
    println!("{:?}\nfloor {:.4}\nprimary {:?}\nsecondary {:?}", e.clouds, e.floor_e3, e.primary, e.secondary);
    let t = Instant::now();
    let pts = field_points(&field, 300000, 9);
    println!("{} points in {:.3} s", pts.len(), t.elapsed().as_secs_f64());
}
