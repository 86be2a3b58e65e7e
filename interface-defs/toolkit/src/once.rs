//! Lists without repetition.

/// Each of these once, in the order in which they first come.
pub fn each_once<T: PartialEq>(items: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut all = Vec::new();
    for item in items {
        if !all.contains(&item) {
            all.push(item);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::each_once;

    #[test]
    fn what_came_before_does_not_come_again() {
        assert_eq!(each_once([3, 1, 3, 2, 1]), [3, 1, 2]);
    }
}
