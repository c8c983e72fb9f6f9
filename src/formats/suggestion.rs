//! Which known word an unknown one was probably meant to be.

/// The candidate nearest to a word, if one is near enough that a slip of the pen explains it.
///
/// Near enough is a third of the word's letters, at least one, counted as insertions, deletions,
/// replacements and swaps of neighbours (optimal string alignment).
pub(super) fn nearest<'a>(word: &str, candidates: &[&'a str]) -> Option<&'a str> {
    const LONGEST: usize = 64;
    let word: Vec<char> = word.to_lowercase().chars().take(LONGEST).collect();
    let allowed = (word.len() / 3).max(1);
    let distances = candidates.iter().map(|&candidate| {
        let letters: Vec<char> = candidate.to_lowercase().chars().collect();
        (slips(&word, &letters), candidate)
    });
    distances
        .filter(|&(distance, _)| distance <= allowed)
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, candidate)| candidate)
}

/// The number of slips that turn one word into the other.
fn slips(left: &[char], right: &[char]) -> usize {
    let mut before_last: Vec<usize> = Vec::new();
    let mut last: Vec<usize> = (0..=right.len()).collect();
    for row in 1..=left.len() {
        let mut current = vec![row];
        for column in 1..=right.len() {
            let differs = usize::from(left[row - 1] != right[column - 1]);
            let mut fewest = (last[column - 1] + differs)
                .min(last[column] + 1)
                .min(current[column - 1] + 1);
            let swapped = row > 1
                && column > 1
                && left[row - 1] == right[column - 2]
                && left[row - 2] == right[column - 1];
            if swapped {
                fewest = fewest.min(before_last[column - 2] + 1);
            }
            current.push(fewest);
        }
        before_last = std::mem::replace(&mut last, current);
    }
    last[right.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_of_the_pen_are_understood_and_other_words_are_not() {
        let known = ["lower_m", "upper_m", "radius_m", "reason", "windows"];
        assert_eq!(nearest("uper_m", &known), Some("upper_m"));
        assert_eq!(nearest("Lower_M", &known), Some("lower_m"));
        assert_eq!(nearest("radius", &known), Some("radius_m"));
        assert_eq!(nearest("raeson", &known), Some("reason"));
        assert_eq!(nearest("colour", &known), None);
        assert_eq!(nearest("", &known), None);
    }
}
