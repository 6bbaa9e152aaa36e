//! Reading on while what was read is used: parsing and writing take as long as the slower of the two.

use std::sync::mpsc::sync_channel;

/// Calls `each` with every item, while another thread makes the next; two are held at most beside the one in
/// use. Stops at the first error.
///
/// # Errors
/// The first that `each` gives.
pub fn read_ahead<T: Send, E>(
    items: impl Iterator<Item = T> + Send,
    each: impl FnMut(T) -> Result<(), E>,
) -> Result<(), E> {
    std::thread::scope(|scope| {
        let (give, take) = sync_channel(0);
        // Nobody takes any more after an error.
        scope.spawn(move || items.map(|item| give.send(item)).take_while(Result::is_ok).for_each(drop));
        take.into_iter().try_for_each(each)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn items_come_in_order_and_an_error_stops_both_sides() {
        let made = AtomicUsize::new(0);
        let items = || {
            (0..1000).inspect(|_| {
                made.fetch_add(1, Ordering::Relaxed);
            })
        };
        let mut seen = Vec::new();
        let all: Result<(), usize> = read_ahead(items(), |item| {
            seen.push(item);
            Ok(())
        });
        assert_eq!((all, seen), (Ok(()), (0..1000).collect()));
        assert_eq!(made.swap(0, Ordering::Relaxed), 1000);
        assert_eq!(read_ahead(items(), |item| if item == 7 { Err(item) } else { Ok(()) }), Err(7));
        // The item in use, and the one that was made meanwhile.
        assert!(made.load(Ordering::Relaxed) <= 10, "{made:?}");
    }
}
