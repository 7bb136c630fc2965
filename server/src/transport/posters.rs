//! Accounts of clients that post maps, one for each client. A client is its token, or else its
//! address.
//!
//! A session has an account of its own. The posts of a client may come over as many connections as
//! it likes. Without a common account, each post would count as a new client that has used no time
//! yet.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError},
};

use super::gate::Key;
use crate::core::scheduler::Account;

/// Beyond so many accounts those without a map under way are thrown away.
const ACCOUNTS_MAX: usize = 1024;

/// All accounts of clients that post.
#[derive(Default)]
pub(crate) struct Posters {
    accounts: Mutex<HashMap<Key, Arc<Account>>>,
    /// Of those who find no place, or are not known.
    others: Arc<Account>,
}

impl Posters {
    /// The account of a client.
    pub(crate) fn account(&self, client: Option<&Key>) -> Arc<Account> {
        let Some(client) = client else { return Arc::clone(&self.others) };
        let mut accounts = self.accounts.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(account) = accounts.get(client) {
            return Arc::clone(account);
        }
        if accounts.len() >= ACCOUNTS_MAX {
            accounts.retain(|_, account| Arc::strong_count(account) > 1);
        }
        if accounts.len() >= ACCOUNTS_MAX {
            return Arc::clone(&self.others);
        }
        Arc::clone(accounts.entry(client.clone()).or_insert_with(|| Account::new(1)))
    }
}

#[cfg(test)]
mod tests {
    use std::net::IpAddr;

    use super::*;

    fn key(n: u32) -> Key {
        Key::of_address(IpAddr::from(n.to_be_bytes()))
    }

    #[test]
    fn posts_of_a_client_share_an_account_and_accounts_are_bounded() {
        let posters = Posters::default();
        let one = posters.account(Some(&key(1)));
        assert!(Arc::ptr_eq(&one, &posters.account(Some(&key(1)))));
        assert!(!Arc::ptr_eq(&one, &posters.account(Some(&key(2)))));
        for n in 0..3 * ACCOUNTS_MAX as u32 {
            posters.account(Some(&key(n)));
        }
        assert!(posters.accounts.lock().unwrap().len() <= ACCOUNTS_MAX);
        // It was held all the time.
        assert!(Arc::ptr_eq(&one, &posters.account(Some(&key(1)))));
        let held: Vec<_> =
            (0..2 * ACCOUNTS_MAX as u32).map(|n| posters.account(Some(&key(n)))).collect();
        assert!(Arc::ptr_eq(&held[held.len() - 1], &posters.account(None)));
    }
}
