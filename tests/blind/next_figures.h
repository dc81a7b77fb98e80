#pragma once

#include <optional>
#include <vector>

#include "tests/blind/figures.h"

namespace blind {

/// What the measurement that an undecided report suggests is worth against as many rows at random places, paired by
/// session: volume of the true cause's intervals, entropy of the causes by class, right names; nothing where `next` did
/// not run.
void addNextFigures(std::vector<Figure>& figures, const std::vector<const Session*>& sessions);

/// Product of the 90 % widths of the suggested measurement's first true cause over that of the same cause in the random
/// one, over the parameters that both have.
/// @return nothing when one of them lacks the cause or shares no interval of finite width
std::optional<double> volumeRatio(const Session& session, const nlohmann::json& suggested,
                                  const nlohmann::json& random);

/// Entropy of the probabilities of causes, those that the design cannot tell apart taken together [nat].
double classEntropy(const Session& session, const nlohmann::json& causes);

}  // namespace blind
