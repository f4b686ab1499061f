//! Many rounds, one after the other: the average cost of a model.

use super::{Game, Player, Round};
use palpate_onboard::Verdict;

/// Approaches after which a round ends, whether or not all have a verdict.
const MOST_APPROACHES: u64 = 20_000;

/// Rounds at random approaches, object after object, each until all models have a verdict.
#[derive(Clone, Debug)]
pub struct Series<'m> {
    seed: u64,
    /// Number of rounds finished.
    pub rounds: u64,
    current: Option<Round<'m>>,
    /// Results of each model, in rounds that all have finished.
    pub scores: Vec<Score>,
}

/// Results of one model.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Score {
    /// Rounds that it has finished.
    pub rounds: u64,
    /// Approaches in all of them, also where it gave up.
    pub approaches: f64,
    /// The sum of the squares of their numbers.
    pub squares: f64,
    /// Rounds in which it named another object.
    pub wrong: u64,
    /// Rounds without a name: it gave up, or said that it does not know the object.
    pub unnamed: u64,
}

impl Score {
    /// The mean number of approaches of a round, and its standard error; none before the second round.
    pub fn mean(&self) -> Option<(f64, f64)> {
        let count = self.rounds as f64;
        let mean = self.approaches / count;
        let variance = (self.squares / count - mean * mean).max(0.0) * count / (count - 1.0);
        (self.rounds > 1).then(|| (mean, (variance / count).sqrt()))
    }

    fn add(&mut self, player: &Player<'_>, object: &str) {
        let approaches = f64::from(player.approaches);
        self.rounds += 1;
        self.approaches += approaches;
        self.squares += approaches * approaches;
        match player.recognizer.verdict() {
            Verdict::Recognized { object: named, .. } => {
                self.wrong += u64::from(player.recognizer.model().object_name(named.into()) != object);
            }
            _ => self.unnamed += 1,
        }
    }
}

impl<'m> Series<'m> {
    /// A series that has not begun.
    pub fn new(game: &Game<'m>, seed: u64) -> Self {
        Self { seed, rounds: 0, current: None, scores: vec![Score::default(); game.models.len()] }
    }

    /// Goes on until `rounds` are finished, or for about `approaches` approaches. Round k touches object k modulo their
    /// number with a seed of its own.
    pub fn go_on(&mut self, game: &Game<'m>, rounds: u64, approaches: u64) {
        let objects = game.objects.len().max(1) as u64;
        let mut left = approaches;
        while self.rounds < rounds && left > 0 {
            let object = usize::try_from(self.rounds % objects).unwrap_or_default();
            let seed = self.seed.wrapping_add(self.rounds);
            let Some(mut round) = self.current.take().or_else(|| game.round(object, seed)) else { return };
            let is_done =
                |round: &Round<'_>| round.next >= MOST_APPROACHES || round.players.iter().all(Player::is_done);
            while left > 0 && !is_done(&round) {
                game.touch_at_random(&mut round);
                left -= 1;
            }
            if is_done(&round) {
                let name = game.objects.get(object).map_or("", |target| target.name.as_str());
                let players = round.players.iter();
                self.scores.iter_mut().zip(players).for_each(|(score, player)| score.add(player, name));
                self.rounds += 1;
            } else {
                self.current = Some(round);
            }
        }
    }
}
