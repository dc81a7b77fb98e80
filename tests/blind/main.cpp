#include <algorithm>
#include <exception>
#include <iostream>
#include <span>
#include <string>
#include <vector>

#include "tests/blind/answer.h"
#include "tests/blind/controls.h"
#include "tests/blind/foretell.h"
#include "tests/blind/generate.h"
#include "tests/blind/kept.h"
#include "tests/blind/next.h"
#include "tests/blind/oracle.h"
#include "tests/blind/replicate.h"
#include "tests/blind/score.h"

namespace {

constexpr const char* kUsage =
    R"(fieldtrue-blind checks the diagnosis of fieldtrue-cli on recordings whose effect is withheld. It shares no code
with the simulator and the diagnosis: it has its own physics, its own pose solver and its own scoring.

  generate   write sessions as node tables without any label, and seal the truth (SHA-256)
  answer     run `fieldtrue-cli diagnose` on them; each answer is written once
  foretell   simulate what the diagnosis found at places that no table held
  oracle     fit the parameters of the true effects to each recording, and put them to the same test
  replicate  have small sessions of one effect diagnosed with replicates
  next       make the measurement that undecided answers suggest, and random ones, and diagnose again
  keep       write what score reads of the answers, in parts of 100 sessions, to be kept for good
  restore    put kept parts back into a set that was drawn again
  score      open the seal and print the scoreboard
  controls   make negative controls of a sealed set: no effect, or nothing that could be named

A whole round:
  fieldtrue-blind generate --seed 7 --sessions 40 --levels --out set
  fieldtrue-blind answer --in set --jobs 2
  fieldtrue-blind foretell --in set --jobs 2
  fieldtrue-blind score --in set --markdown score.md

`fieldtrue-blind COMMAND --help` tells the options of one command.
)";

constexpr const char* kGenerateHelp =
    R"(Writes sessions as node tables (a quarter with sample tables too), truth.json and the seal.json that holds its SHA-256.
The same seed and options give the same bytes, whatever --jobs. A quarter of the sessions has no effect; the others have
one of the catalogue, two or three at once, one that stands in no catalogue, or a fault of the signal.

  --out DIR        folder to write; must not hold a set already
  --seed N         whole number from 0
  --sessions K     how many (also --count)
  --levels         four fifths of the single effects at exactly 0.35, 0.7, 1.4 and 2.8 of gap to noise, the rest between
  --strength X     every single effect at X of gap to noise
  --shelf S        only none, single, pairs, off, unforeseen or signals; default all, the unforeseen left out
  --unforeseen B   on top, eight sessions of each unforeseen kind of batch B (1 is the oldest), two at each strength;
                   with --shelf unforeseen the batch that is drawn from (1)
  --samples        sample tables for every session
  --max-rows R     no session with more rows than R (48 or more)
  --role R         dev (default) or test, written into the seal
  --cli PATH       fieldtrue-cli, whose plan-check declares what a design cannot tell apart; default beside this program
  --jobs J         sessions made side by side (also --threads)

Example: fieldtrue-blind generate --seed 7 --sessions 1200 --levels --role test --jobs 2 --out set
)";

constexpr const char* kAnswerHelp =
    R"(Runs `fieldtrue-cli diagnose` on every session of a sealed set, each in a folder of its own that holds nothing but its
tables. Sessions that are answered already are left as they are, so that a run that was stopped can be started again.

  --in DIR         sealed set
  --cli PATH       the program to run; default fieldtrue-cli beside this program
  --jobs J         diagnoses side by side, one thread each; default 1
  --from A --to B  only sessions A to B, counted from 1: processes and machines can share a set
  --limit SECONDS  a diagnosis that takes longer is ended and counts as wrong; default 600
  --again          answer again what is answered already

Example: fieldtrue-blind answer --in set --jobs 2 --limit 120
)";

constexpr const char* kForetellHelp =
    R"(Simulates the scene that each diagnosis left behind at the 200 sealed places of its session, without noise and without
fitting anything again, and compares with what the generator's tracker would report there. The start is an alignment alone,
fitted to the same rows. Writes DIR/foretold.json, which score reads.

  --in DIR         answered set
  --cli PATH       the program to run; default fieldtrue-cli beside this program
  --jobs J         simulations side by side; default 1

Example: fieldtrue-blind foretell --in set --jobs 2
)";

constexpr const char* kOracleHelp =
    R"(Fits the true effects of every session (right kinds, from their true parameters on) and its alignment to the recorded
rows, by least squares with the generator's own physics, and compares what that foretells at the 200 sealed places with
the sealed poses. So far these readings could take away what the effect does: score sets the reports against it.
Writes DIR/oracle.json; what is in it already is left, so that a run that was stopped can be started again.

  --in DIR         sealed set, of this very build of fieldtrue-blind: its sessions are made again from the seed
  --jobs J         sessions side by side; default 1
  --from A --to B  only sessions A to B, counted from 1: processes can share a set

Example: fieldtrue-blind oracle --in set --jobs 2
)";

constexpr const char* kReplicateHelp =
    R"(Runs `fieldtrue-cli diagnose --replicates M` on the first sessions of one effect and at most 100 places, each in a folder
of its own that holds nothing but its tables, and keeps in how many replicates the same was named. score compares the
mean of these shares with how often what was named is the truth. The program makes replicates under its runner-up too;
they are not used. Writes DIR/replicated.json; what is in it already is left.

  --in DIR          sealed set
  --cli PATH        the program to run; default fieldtrue-cli beside this program
  --sessions N      how many sessions at most; default 60
  --replicates M    of each; default 20
  --jobs J          diagnoses side by side, one thread each; default 1

Example: fieldtrue-blind replicate --in set --sessions 60 --jobs 2
)";

constexpr const char* kNextHelp =
    R"(Where an answer leaves the cause open (several in the first candidate's class, or less than 0.9 for it) and its sentence
on the next measurement asks for further rows, they are made in the session's own world, with the same rig, seating and
scatter, and put behind its table; beside it as many rows at random places, up to one step outside the grid. Both tables
are diagnosed. score compares how large the true cause's intervals are then, how open the cause still is, and how often
it is named right. Writes DIR/next.json; what is in it already is left.

  --in DIR         answered set, of this very build of fieldtrue-blind: its sessions are made again from the seed
  --cli PATH       the program to run; default fieldtrue-cli beside this program
  --sessions N     how many sessions with one effect or several at most; default 150
  --jobs J         sessions side by side; default 1

Example: fieldtrue-blind next --in set --sessions 150 --jobs 2
)";

constexpr const char* kKeepHelp =
    R"(Writes FOLDER/part_NN.json for every hundred sessions that are answered and foretold, with what score reads of each
report, the hashes of the whole report and scene, and the engine's commit; and FOLDER/oracle.json and so on, as far as they
are. A part is never written again. So a set can be answered on different days and machines, and scored from what is kept.

  --in DIR         answered set
  --kept FOLDER    where parts are kept, such as tests/blind/results/NAME
  --engine ID      commit of the program that answered, 40 hexadecimal digits

Example: fieldtrue-blind keep --in set --kept tests/blind/results/first --engine $(git rev-parse HEAD)
)";

constexpr const char* kRestoreHelp =
    R"(Puts what `keep` wrote back into a set that was drawn again from its seed; sessions that are answered in it already stay
as they are. answer and foretell then go on with the others, and score needs nothing else.

  --in DIR         sealed set
  --kept FOLDER    where its parts are kept

Example: fieldtrue-blind restore --in set --kept tests/blind/results/first
)";

constexpr const char* kScoreHelp =
    R"(Checks truth and answers against their hashes and prints every figure with its 95 % interval (Wilson for shares,
bootstrap otherwise), its target where there is one, and the confusion matrix. What was not answered counts as wrong.

  --in DIR         answered set
  --controls DIR   answered negative controls to add
  --json FILE      the same as JSON
  --markdown FILE  the same as Markdown

Example: fieldtrue-blind score --in set --controls set_controls --markdown score.md
)";

constexpr const char* kControlsHelp =
    R"(Makes negative controls of a sealed set, sealed themselves.
From sessions without an effect, which must show no gap: stated noise and tolerances 20 % too large (floor_+20%) or too
small (floor_-20%, here a gap may be seen, but no cause), time reversed (time_reversed); red noise over the session in
place of white, of the same scatter (red_noise); no tolerance of the jig stated (tolerance_absent), or half of the true
one (tolerance_half, here a gap may be seen, but no cause).
From sessions with one effect, which must not be given a cause: places shuffled among the nodes (shuffled), readings
mirrored (mirrored), readings beside the places of another session (other_truth), residuals of the alignment exchanged
among rows of like range (residuals_permuted).
From sessions with an effect in time, which may be given no other cause: time reversed (drift_reversed).

  --in DIR           sealed set
  --out DIR          folder to write; must not hold a set already
  --count N          of each kind; default 20
  --effect-free M    of red_noise, tolerance_absent and tolerance_half; default N

Example: fieldtrue-blind controls --in set --out set_controls --count 40 --effect-free 300
)";

struct Command {
  const char* name;
  const char* help;
  int (*run)(std::span<const std::string>);
};

constexpr Command kCommands[] = {
    {"generate", kGenerateHelp, blind::runGenerate},
    {"answer", kAnswerHelp, blind::runAnswer},
    {"foretell", kForetellHelp, blind::runForetell},
    {"oracle", kOracleHelp, blind::runOracle},
    {"replicate", kReplicateHelp, blind::runReplicate},
    {"next", kNextHelp, blind::runNext},
    {"keep", kKeepHelp, blind::runKeep},
    {"restore", kRestoreHelp, blind::runRestore},
    {"score", kScoreHelp, blind::runScore},
    {"controls", kControlsHelp, blind::runControls},
};

bool isHelp(const std::string& word) { return word == "--help" || word == "-h"; }

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments.empty() || isHelp(arguments.front())) {
    (arguments.empty() ? std::cerr : std::cout) << kUsage;
    return arguments.empty() ? 2 : 0;
  }
  for (const Command& command : kCommands) {
    if (arguments.front() != command.name) continue;
    if (std::any_of(arguments.begin() + 1, arguments.end(), isHelp)) {
      std::cout << command.help;
      return 0;
    }
    try {
      return command.run(std::span(arguments).subspan(1));
    } catch (const std::exception& problem) {
      std::cerr << command.name << ": " << problem.what() << '\n';
      return 1;
    }
  }
  std::string names;
  for (const Command& command : kCommands) names += std::string(names.empty() ? "" : ", ") + command.name;
  std::cerr << "'" << arguments.front() << "' is no command of fieldtrue-blind; it has " << names
            << " (--help tells more)\n";
  return 2;
}
