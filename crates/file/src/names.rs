/// The candidate that `name` was probably meant to be, if one is close enough to suggest.
///
/// Close enough is a Damerau–Levenshtein distance of at most a third of the longer name, or a shared prefix
/// of three letters: past that a suggestion confuses more than it helps.
///
/// ```
/// assert_eq!(halflight_file::nearest_name("exponnent", ["albedo", "exponent"]), Some("exponent"));
/// assert_eq!(halflight_file::nearest_name("zzz", ["albedo", "exponent"]), None);
/// ```
pub fn nearest_name<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let lower = name.to_lowercase();
    let distance = |candidate: &str| strsim::damerau_levenshtein(&lower, &candidate.to_lowercase());
    let nearest = candidates.into_iter().min_by_key(|candidate| distance(candidate))?;
    let shares_prefix =
        lower.len() >= 3 && nearest.to_lowercase().starts_with(lower.get(..3).unwrap_or("\0"));
    let close = distance(nearest) * 3 <= lower.chars().count().max(nearest.chars().count());
    (close || shares_prefix).then_some(nearest)
}
