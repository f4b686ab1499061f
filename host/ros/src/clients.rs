//! Clients of a service whose requests arrive before it is known where their responses go.
//!
//! A client's writer of requests and its reader of responses are announced separately. A response that is written before the
//! reader has been found is lost, and the client waits forever. The middlewares of ROS 2 let the service wait too.

use ros2_client::dds::rustdds::GUID;
use ros2_client::{Context, Node};
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::time::Duration;

/// Time between looks at what discovery has found.
const LOOK_EVERY: Duration = Duration::from_millis(10);
/// Number of looks after which a client counts as not listening.
const LOOKS: usize = 100;

/// The clients of one service.
pub(crate) struct Clients<'n> {
    context: &'n Context,
    requests: String,
    responses: String,
    /// Writers of requests that need not be waited for again.
    known: RefCell<BTreeSet<GUID>>,
}

/// The clients of the node's service and of its action, which has three services.
pub(crate) struct AllClients<'n> {
    pub(crate) reset: Clients<'n>,
    pub(crate) goals: Clients<'n>,
    pub(crate) cancellations: Clients<'n>,
    pub(crate) results: Clients<'n>,
}

impl<'n> AllClients<'n> {
    pub(crate) fn new(context: &'n Context, node: &Node) -> Self {
        let of = |service| Clients::new(context, &format!("{}/{service}", node.fully_qualified_name()));
        Self {
            reset: of("reset"),
            goals: of("recognize/_action/send_goal"),
            cancellations: of("recognize/_action/cancel_goal"),
            results: of("recognize/_action/get_result"),
        }
    }
}

impl<'n> Clients<'n> {
    /// The clients of a service with an absolute name, such as `/palpate/reset`.
    fn new(context: &'n Context, service: &str) -> Self {
        let (requests, responses) = (format!("rq{service}Request"), format!("rr{service}Reply"));
        Self { context, requests, responses, known: RefCell::default() }
    }

    /// Waits until responses reach every client: each participant that writes requests needs a reader of responses.
    /// Takes a second at most, and a participant that has none by then is not waited for again.
    pub(crate) async fn wait_until_listening(&self) {
        let mut looks = 0;
        while self.is_one_not_listening() && looks < LOOKS {
            smol::Timer::after(LOOK_EVERY).await;
            looks += 1;
        }
        if looks > 0 {
            // The writer of responses learns of a reader a moment after discovery.
            smol::Timer::after(LOOK_EVERY).await;
            *self.known.borrow_mut() = self.asking();
        }
    }

    fn is_one_not_listening(&self) -> bool {
        let readers = self.context.domain_participant().discovered_readers();
        let listening: BTreeSet<_> = (readers.iter())
            .filter(|reader| reader.subscription_topic_data.topic_name == self.responses)
            .map(|reader| reader.reader_proxy.remote_reader_guid.prefix)
            .collect();
        self.asking().difference(&self.known.borrow()).any(|writer| !listening.contains(&writer.prefix))
    }

    /// Writers of requests.
    fn asking(&self) -> BTreeSet<GUID> {
        let writers = self.context.domain_participant().discovered_writers();
        (writers.iter())
            .filter(|writer| writer.publication_topic_data.topic_name == self.requests)
            .map(|writer| writer.writer_proxy.remote_writer_guid)
            .collect()
    }
}
