use palpate_simulator::error::Problem;
use palpate_simulator::probe::noise::quantity::{angle, duration, length, share};

#[test]
fn quantities_have_units() {
    assert_eq!((duration("5ms"), duration("300us"), duration("0.005 s")), (Ok(5e3), Ok(300.0), Ok(5e3)));
    assert_eq!((length("0.5mm"), length("300um")), (Ok(500.0), Ok(300.0)));
    assert_eq!((angle("5deg"), angle("0.5°")), (Ok(5.0), Ok(0.5)));
    assert_eq!((share("2%"), share("0.02"), share("2 %")), (Ok(0.02), Ok(0.02), Ok(0.02)));
}

#[test]
fn what_is_no_quantity_is_refused_with_an_example() {
    for text in ["5", "ms", "-1ms", "1e999s", "5 m", ""] {
        let problem = duration(text).unwrap_err();
        assert!(problem.fix().contains("5ms"), "{text}: {problem}");
    }
    for text in ["5", "mm", "-1mm", "1m", "nanmm"] {
        assert!(length(text).unwrap_err().fix().contains("1mm"), "{text}");
    }
    for text in ["5", "deg", "-1deg", "5rad"] {
        assert!(angle(text).unwrap_err().fix().contains("5deg"), "{text}");
    }
    for text in ["few", "%", "-2%", "2%%", "nan"] {
        assert!(share(text).unwrap_err().fix().contains("2%"), "{text}");
    }
}
