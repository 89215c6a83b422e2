//! Missing blocks as job arrays that a cluster takes.

/// Slurm's own limit where a cluster sets none.
pub const USUAL_MAX_ARRAY_SIZE: usize = 1001;

/// One job array. A task runs the block whose number is the array's offset plus the task's index.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JobArray {
    pub offset: usize,
    /// Ascending, each below the cluster's limit.
    pub indices: Vec<usize>,
}

impl JobArray {
    /// Deals ascending block numbers to arrays. A cluster's limit bounds the indices, not only their count, so each array
    /// covers `max_array_size` numbers from its offset on.
    pub fn deal(missing: &[usize], max_array_size: usize) -> Vec<JobArray> {
        let mut arrays: Vec<JobArray> = Vec::new();
        for number in missing {
            let (offset, index) = (number - number % max_array_size, number % max_array_size);
            match arrays.last_mut().filter(|last| last.offset == offset) {
                Some(last) => last.indices.push(index),
                None => arrays.push(JobArray { offset, indices: vec![index] }),
            }
        }
        arrays
    }

    /// The indices as Slurm lists them, consecutive ones as a range: `0-3,7`.
    pub fn list(&self) -> String {
        ranges(&self.indices)
    }

    /// The numbers of its blocks, listed likewise.
    pub fn blocks(&self) -> String {
        ranges(&self.indices.iter().map(|index| self.offset + index).collect::<Vec<_>>())
    }
}

/// Ascending numbers, consecutive ones as a range.
pub fn ranges(numbers: &[usize]) -> String {
    let runs = numbers.chunk_by(|a, b| a + 1 == *b).map(|run| match run {
        [first, .., last] => format!("{first}-{last}"),
        [only] => only.to_string(),
        [] => String::new(),
    });
    runs.collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sparse_numbers_become_ranges() {
        let list = |indices: &[usize]| JobArray { offset: 0, indices: indices.to_vec() }.list();
        assert_eq!(list(&[4]), "4");
        assert_eq!(list(&[0, 1, 2, 3]), "0-3");
        assert_eq!(list(&[2, 5, 6, 9]), "2,5-6,9");
    }

    #[test]
    fn arrays_are_split_at_the_limit_and_cover_every_block_once() {
        let missing: Vec<usize> = (0..25).filter(|number| ![3, 9, 10].contains(number)).collect();
        let arrays = JobArray::deal(&missing, 10);
        let lists: Vec<_> = arrays.iter().map(|array| (array.offset, array.list())).collect();
        assert_eq!(lists, [(0, "0-2,4-8".into()), (10, "1-9".into()), (20, "0-4".to_string())]);
        assert_eq!(arrays[1].blocks(), "11-19");
        let numbers = arrays.iter().flat_map(|array| array.indices.iter().map(|index| array.offset + index));
        assert_eq!(numbers.collect::<Vec<_>>(), missing);
        assert_eq!(JobArray::deal(&[0, 1], 1).len(), 2, "an array of one task each");
        assert_eq!(JobArray::deal(&[], 10), []);
    }
}
