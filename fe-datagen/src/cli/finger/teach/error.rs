//! Why a finger is not taught.

use std::path::PathBuf;

/// What is wrong, where, and what to do.
#[derive(Debug, thiserror::Error)]
pub(super) enum TeachError {
    /// Nothing says how many presses.
    #[error(
        "how many presses? --hours 4 takes as many as four core hours allow, --presses 50 takes 50"
    )]
    HowMany,
    /// Too few to hold one out.
    #[error("--presses {presses}: at least {least} are needed, of which one is held out")]
    FewPresses {
        /// Asked for.
        presses: usize,
        /// Fewest.
        least: usize,
    },
    /// More than the sequence is meant for.
    #[error("--presses {presses}: at most {most}")]
    ManyPresses {
        /// Asked for.
        presses: usize,
        /// Most.
        most: usize,
    },
    /// No number of hours.
    #[error("--hours {0}: has to be a number above 0")]
    Hours(f64),
    /// Not enough time for anything.
    #[error(
        "--hours {hours}: {least} presses, contact and training already take about {needed:.2} core \
         hours on this machine; give so many, or --presses"
    )]
    ShortHours {
        /// Asked for.
        hours: f64,
        /// Fewest presses.
        least: usize,
        /// Hours of these.
        needed: f64,
    },
    /// Skin under tension has no contact that networks for poses could learn from.
    #[error(
        "{}: its skin is under tension (skin_tension_n_per_mm), and then there is no contact on pixels, \
         which networks for poses learn from; add --without-contact --network {network} for a network \
         for pressure, or leave the tension out",
        folder.display()
    )]
    Tension {
        /// The finger.
        folder: PathBuf,
        /// A network that learns from FE's pressure.
        network: &'static str,
    },
    /// The presses there are of something else.
    #[error(
        "{}: these presses were begun for other dimensions or tissues of the finger, another campaign \
         or another version; move the folder away to begin anew",
        folder.display()
    )]
    OtherPresses {
        /// The dataset.
        folder: PathBuf,
    },
    /// Fewer presses than are planned already.
    #[error(
        "{} has {planned} presses, and --presses asks for {asked}: give {planned} or more, or move \
         the folder {} away",
        campaign.display(),
        campaign.parent().unwrap_or(campaign).display()
    )]
    Fewer {
        /// The campaign of the bundle.
        campaign: PathBuf,
        /// Its presses.
        planned: usize,
        /// Asked for.
        asked: usize,
    },
    /// A network to begin with is not there.
    #[error("there is no {}: --network names one of {}, and --from their folder", file.display(), known.join(", "))]
    NoNetwork {
        /// The file looked for.
        file: PathBuf,
        /// Those that are there.
        known: Vec<String>,
    },
    /// A network to begin with cannot be trained.
    #[error(
        "{}: its card says '{kind}'; only single networks on maps, such as small, can be trained on",
        card.display()
    )]
    NotTrainable {
        /// The card.
        card: PathBuf,
        /// Kind of the network.
        kind: String,
    },
    /// A network of another finger in the bundle.
    #[error(
        "{}: a network of another finger (atlas {found}), which cannot stand beside networks of this \
         one; add --network {name}, or take it away",
        file.display()
    )]
    Stranger {
        /// The network.
        file: PathBuf,
        /// Its name.
        name: String,
        /// Its atlas.
        found: String,
    },
    /// A program that a step needs.
    #[error("{what} is needed, and {program} {problem}; {cure}")]
    NoProgram {
        /// For what.
        what: &'static str,
        /// The program.
        program: String,
        /// What came of it.
        problem: String,
        /// What to do.
        cure: &'static str,
    },
    /// A step failed.
    #[error(
        "{command}: ended with {status}; mend what it says above, then run the same command again"
    )]
    Step {
        /// Command line.
        command: String,
        /// Its exit status.
        status: String,
    },
    /// What a step printed cannot be read.
    #[error("{command}: printed what cannot be read: {problem}")]
    Said {
        /// Command line.
        command: String,
        /// What is wrong with it.
        problem: String,
    },
    /// Too many presses failed.
    #[error(
        "{failed} of {presses} presses failed (`fe-datagen dataset status {}` names them): too many \
         to learn from the others",
        folder.display()
    )]
    Failed {
        /// How many.
        failed: usize,
        /// Of how many.
        presses: usize,
        /// The dataset.
        folder: PathBuf,
    },
    /// The bundle's atlas is of another finger.
    #[error(
        "{}: another atlas than that of the presses; take the file away, and {} too",
        atlas.display(),
        contact.display()
    )]
    OtherAtlas {
        /// The bundle's.
        atlas: PathBuf,
        /// The bundle's contact model, which goes with it.
        contact: PathBuf,
    },
    /// Ctrl-C or TERM.
    #[error("interrupted: the same command goes on from here")]
    Interrupted,
}
