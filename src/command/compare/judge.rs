//! `--fail-above relmse=0.01`: an exit code for scripts.

use std::str::FromStr;

use halflight_file::nearest_name;
use halflight_image::report::{Figures, Row};
use serde_json::json;

use super::CompareArgs;
use crate::command::console::Console;
use crate::command::failure::Failure;
use crate::command::words;

/// A figure and its limit.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Limit {
    figure: &'static str,
    value: f64,
}

impl FromStr for Limit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, value) = text
            .split_once('=')
            .ok_or_else(|| format!("expected FIGURE=LIMIT, for example relmse=0.01, found {text:?}"))?;
        let name = name.trim().to_lowercase();
        let Some(figure) = Row::FIGURES.into_iter().find(|figure| *figure == name) else {
            let hint = match nearest_name(&name, Row::FIGURES) {
                Some(near) => format!("did you mean {near}?"),
                None => format!("there are {}", Row::FIGURES.join(", ")),
            };
            return Err(format!("there is no figure {name:?} ({hint})"));
        };
        match value.trim().parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Self { figure, value }),
            _ => Err(format!("the limit of {figure} is not a number: {value:?}")),
        }
    }
}

/// Which side of a limit is wrong.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Above,
    Below,
}

/// Fails if any candidate breaks a limit.
pub(super) fn judge(args: &CompareArgs, figures: &Figures, console: Console) -> Result<(), Failure> {
    let limits = || {
        let above = args.fail_above.iter().map(|limit| (limit, Side::Above));
        above.chain(args.fail_below.iter().map(|limit| (limit, Side::Below)))
    };
    let mut broken = Vec::new();
    for row in &figures.candidates {
        for (limit, side) in limits() {
            let value = row.figure(limit.figure).unwrap_or(f64::NAN);
            if breaks(value, limit.value, side) {
                let side = if side == Side::Above { "above" } else { "below" };
                broken.push(format!(
                    "{} of {} is {}, {side} the limit of {}",
                    limit.figure,
                    row.name,
                    words::figure(value),
                    words::figure(limit.value)
                ));
                console.event(
                    "broken",
                    json!({ "figure": limit.figure, "of": row.name, "value": value, "limit": limit.value }),
                );
            }
        }
    }
    if broken.is_empty() { Ok(()) } else { Err(Failure::Failed(broken.join("\nerror: "))) }
}

/// What is not a number keeps no limit.
fn breaks(value: f64, limit: f64, side: Side) -> bool {
    value.is_nan() || if side == Side::Above { value > limit } else { value < limit }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_name_a_figure_and_a_number() {
        assert_eq!("relMSE=0.01".parse(), Ok(Limit { figure: "relmse", value: 0.01 }));
        assert!("relmse".parse::<Limit>().is_err() && "relmse=x".parse::<Limit>().is_err());
        assert!("relms=1".parse::<Limit>().unwrap_err().contains("did you mean relmse?"));
    }

    #[test]
    fn what_is_not_a_number_keeps_no_limit() {
        assert!(breaks(f64::NAN, 1.0, Side::Above) && breaks(f64::NAN, 1.0, Side::Below));
        assert!(breaks(2.0, 1.0, Side::Above) && !breaks(1.0, 1.0, Side::Above));
        assert!(breaks(20.0, 30.0, Side::Below) && !breaks(f64::INFINITY, 30.0, Side::Below));
    }
}
