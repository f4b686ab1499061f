use palpate_simulator::error::{Result, problem};
use palpate_simulator::in_order::in_order;
use rayon::prelude::*;

#[test]
fn the_first_failure_in_order_is_returned_although_a_later_one_comes_sooner() {
    let later_failed = std::sync::Barrier::new(2);
    let one = |number: u32| -> Result<u32> {
        match number {
            1 => {
                later_failed.wait();
                std::thread::sleep(std::time::Duration::from_millis(20));
            }
            7 => _ = later_failed.wait(),
            _ => return Ok(number),
        }
        Err(problem!("number {number} failed"))
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(8).build().unwrap();
    let failed = pool.install(|| in_order((0..8).into_par_iter().with_max_len(1).map(one))).unwrap_err();
    assert_eq!(failed.to_string(), "number 1 failed");
    assert_eq!(in_order([Ok(2), Ok(3)].into_par_iter()).unwrap(), [2, 3]);
}
