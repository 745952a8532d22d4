//! Prints what each kernel costs: `kernel_times [simd level] [orders …]`.

use halflight_sh::{Simd, bench};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let simd = Simd::from_name(arguments.next().as_deref().unwrap_or("auto"))?;
    let mut orders = arguments.map(|order| order.parse()).collect::<Result<Vec<usize>, _>>()?;
    if orders.is_empty() {
        orders = vec![4, 6];
    }
    println!("nanoseconds for each vector on one core, batched kernels with {}", simd.name());
    for order in orders {
        for line in bench::measure(order, simd, 40)? {
            let form = if line.batched { "batched" } else { "single" };
            let goal = line.goal.map_or(String::new(), |goal| format!("goal {goal}"));
            println!("order {order}  {form:8} {:24} {:9.2}  {goal}", line.kernel, line.nanoseconds);
        }
    }
    Ok(())
}
