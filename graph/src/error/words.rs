//! Small helps for messages.

/// `; did you mean `x`?` for the closest known name, or nothing.
pub(crate) fn did_you_mean<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> String {
    let best = known.map(|other| (distance(name, other), other)).min();
    match best {
        Some((distance, other)) if distance <= 2.max(name.len() / 3) => format!("; did you mean `{other}`?"),
        _ => String::new(),
    }
}

/// The `most` known names that are near to `name`, nearest first; if none is near, the nearest all the same.
pub(crate) fn nearest<'a>(name: &str, known: impl Iterator<Item = &'a str>, most: usize) -> Vec<&'a str> {
    let mut ranked: Vec<(bool, usize, &str)> =
        known.map(|other| (!other.contains(name) && !name.contains(other), distance(name, other), other)).collect();
    ranked.sort_unstable();
    let is_near = |&(apart, distance, _): &(bool, usize, &str)| !apart || distance <= 2.max(name.len() / 3);
    if ranked.first().is_some_and(is_near) {
        ranked.retain(is_near);
    }
    ranked.into_iter().take(most).map(|(.., other)| other).collect()
}

/// Levenshtein distance, in characters.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let above = row[j + 1];
            row[j + 1] = (diagonal + usize::from(x != *y)).min(above + 1).min(row[j] + 1);
            diagonal = above;
        }
    }
    row[b.len()]
}

/// "`a`, `b` and `c`", or "none".
pub(crate) fn names<'a>(items: impl IntoIterator<Item = &'a str>) -> String {
    listed(items, "and")
}

/// "`a`, `b` or `c`", or "none".
pub(crate) fn choices<'a>(items: impl IntoIterator<Item = &'a str>) -> String {
    listed(items, "or")
}

fn listed<'a>(items: impl IntoIterator<Item = &'a str>, word: &str) -> String {
    let quoted: Vec<String> = items.into_iter().map(|name| format!("`{name}`")).collect();
    match quoted.as_slice() {
        [] => "none".to_owned(),
        [one] => one.clone(),
        [head @ .., last] => format!("{} {word} {last}", head.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suggestions_come_only_when_close() {
        assert_eq!(did_you_mean("photon", ["photons", "materials"].into_iter()), "; did you mean `photons`?");
        assert_eq!(did_you_mean("zzz", ["photons"].into_iter()), "");
        assert_eq!(distance("kitten", "sitting"), 3);
    }

    #[test]
    fn the_nearest_names_come_first() {
        let known = ["compose", "gbuffer", "photon_trace", "gather", "photon_trace#2"];
        assert_eq!(nearest("gbufer", known.into_iter(), 2), ["gbuffer"]);
        assert_eq!(nearest("photon", known.into_iter(), 2), ["photon_trace", "photon_trace#2"], "a part of a name is near it");
        assert_eq!(nearest("zzz", known.into_iter(), 3).len(), 3, "nothing is near");
    }

    #[test]
    fn names_read_as_a_sentence() {
        assert_eq!(names([]), "none");
        assert_eq!(names(["a"]), "`a`");
        assert_eq!(names(["a", "b", "c"]), "`a`, `b` and `c`");
        assert_eq!(choices(["a", "b"]), "`a` or `b`");
    }
}
