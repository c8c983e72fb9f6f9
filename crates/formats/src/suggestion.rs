//! Which known word an unknown one was probably meant to be.

/// The candidates nearest to a word, of those near enough that a slip of the pen explains it: at
/// most this many, the nearest first, and of equally near ones those that come first.
///
/// Near enough is a third of the word's letters, at least one, counted as insertions, deletions,
/// replacements and swaps of neighbours (optimal string alignment), in capitals or not.
pub fn nearest<'a>(
    word: &str,
    candidates: impl IntoIterator<Item = &'a str>,
    at_most: usize,
) -> Vec<&'a str> {
    const LONGEST: usize = 64;
    let word: Vec<char> = word.to_lowercase().chars().take(LONGEST).collect();
    let allowed = (word.len() / 3).max(1);
    let near = candidates.into_iter().filter_map(|candidate| {
        let letters: Vec<char> = candidate.to_lowercase().chars().collect();
        // No word is nearer than the difference in length.
        if word.len().abs_diff(letters.len()) > allowed {
            return None;
        }
        let distance = slips(&word, &letters);
        (distance <= allowed).then_some((distance, candidate))
    });
    let mut near: Vec<(usize, &str)> = near.collect();
    near.sort_by_key(|&(distance, _)| distance);
    near.truncate(at_most);
    near.into_iter().map(|(_, candidate)| candidate).collect()
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
        let nearest_known = |word: &str| nearest(word, known, 3);
        assert_eq!(nearest_known("uper_m"), ["upper_m"]);
        assert_eq!(nearest_known("Lower_M"), ["lower_m"]);
        assert_eq!(nearest_known("radius"), ["radius_m"]);
        assert_eq!(nearest_known("raeson"), ["reason"]);
        assert_eq!(nearest_known("colour"), [""; 0]);
        assert_eq!(nearest_known(""), [""; 0]);
    }

    #[test]
    fn of_equally_near_words_the_first_come_first() {
        let known = ["north", "roof 3", "roof 1", "roof 12", "roof 2"];
        assert_eq!(nearest("roof 9", known, 2), ["roof 3", "roof 1"]);
        assert_eq!(nearest("roof 1", known, 2), ["roof 1", "roof 3"]);
        // A swap is one slip, and a word of three letters allows for no more.
        assert_eq!(nearest("abc", ["bca", "acb"], 2), ["acb"]);
    }
}
