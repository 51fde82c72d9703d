//! A bounded queue in which no tenant waits for another's backlog.

use std::collections::{BTreeMap, VecDeque};

use schemas::{Error, ErrorCode, Tenant};

/// Things that wait, by tenant. Tenants take turns; within a tenant the oldest goes first.
#[derive(Debug)]
pub(crate) struct FairQueue<T> {
    of_tenant: BTreeMap<Tenant, VecDeque<T>>,
    /// Tenants that have something waiting; the first one is next.
    turns: VecDeque<Tenant>,
    count: usize,
    count_max: usize,
}

impl<T> FairQueue<T> {
    pub(crate) fn new(count_max: usize) -> Self {
        Self { of_tenant: BTreeMap::new(), turns: VecDeque::new(), count: 0, count_max }
    }

    /// Appends.
    ///
    /// One tenant alone may use half of the room, so that a backlog never shuts others out.
    ///
    /// # Errors
    /// The thing itself with [`ErrorCode::Capacity`] when there is no room.
    pub(crate) fn push(&mut self, tenant: Tenant, thing: T) -> Result<(), (T, Error)> {
        let waiting = self.of_tenant.get(&tenant).map_or(0, VecDeque::len);
        if self.count >= self.count_max || waiting >= self.count_max.div_ceil(2) {
            let error =
                Error::new(ErrorCode::Capacity, "too many pictures are waiting to be drawn")
                    .wanted(format_args!(
                        "at most {} jobs, half of them of one tenant",
                        self.count_max
                    ))
                    .found(format_args!("{} jobs, {waiting} of {tenant}", self.count));
            return Err((thing, error));
        }
        if waiting == 0 {
            self.turns.push_back(tenant.clone());
        }
        self.of_tenant.entry(tenant).or_default().push_back(thing);
        self.count += 1;
        Ok(())
    }

    /// Takes the next thing; its tenant goes to the end of the line.
    pub(crate) fn pop(&mut self) -> Option<T> {
        let tenant = self.turns.pop_front()?;
        let waiting = self.of_tenant.get_mut(&tenant)?;
        let thing = waiting.pop_front();
        if waiting.is_empty() {
            self.of_tenant.remove(&tenant);
        } else {
            self.turns.push_back(tenant);
        }
        self.count -= usize::from(thing.is_some());
        thing
    }

    /// Takes things in turn, until they are so many or cost so much; at least one.
    pub(crate) fn pop_some(
        &mut self,
        count_max: usize,
        cost_max: usize,
        cost: impl Fn(&T) -> usize,
    ) -> Vec<T> {
        let (mut taken, mut sum) = (Vec::new(), 0);
        while taken.len() < count_max && sum < cost_max {
            let Some(thing) = self.pop() else { break };
            sum += cost(&thing);
            taken.push(thing);
        }
        taken
    }

    pub(crate) fn len(&self) -> usize {
        self.count
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.count == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tenant(name: &str) -> Tenant {
        name.parse().unwrap()
    }

    #[test]
    fn tenants_take_turns_and_each_keeps_its_order() {
        let mut queue = FairQueue::new(16);
        for number in 0..4 {
            queue.push(tenant("many"), ("many", number)).unwrap();
        }
        queue.push(tenant("few"), ("few", 0)).unwrap();
        queue.push(tenant("one"), ("one", 0)).unwrap();
        let order: Vec<_> = std::iter::from_fn(|| queue.pop()).collect();
        assert_eq!(
            order,
            [("many", 0), ("few", 0), ("one", 0), ("many", 1), ("many", 2), ("many", 3)]
        );
        assert!(queue.is_empty());
    }

    #[test]
    fn a_few_small_things_are_taken_together_and_large_ones_one_by_one() {
        let mut queue = FairQueue::new(32);
        for cost in [9, 9, 1, 1, 1, 1] {
            queue.push(tenant("many"), cost).unwrap();
        }
        queue.push(tenant("few"), 1).unwrap();
        let mut taken = || queue.pop_some(3, 4, |cost| *cost);
        assert_eq!(
            [taken(), taken(), taken(), taken()],
            [vec![9], vec![1, 9], vec![1; 3], vec![1]]
        );
        assert!(taken().is_empty());
    }

    #[test]
    fn a_tenant_with_a_backlog_leaves_room_for_others() {
        let mut queue = FairQueue::new(4);
        queue.push(tenant("many"), 1).unwrap();
        queue.push(tenant("many"), 2).unwrap();
        let (refused, error) = queue.push(tenant("many"), 3).unwrap_err();
        assert_eq!((refused, error.code), (3, ErrorCode::Capacity));
        queue.push(tenant("few"), 4).unwrap();
        queue.push(tenant("few"), 5).unwrap();
        assert_eq!(queue.push(tenant("other"), 6).unwrap_err().1.code, ErrorCode::Capacity);
    }
}
