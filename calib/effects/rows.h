#pragma once

#include "calib/effects/effect_row.h"

/// The row of every effect, declared; each is defined in the file of its effect, and registry.cpp orders them.
namespace fieldtrue::effects {

Effect coilGainEffect();
Effect closedLoopEffect();
Effect compactMetalEffect();
Effect coilNonorthogonalityEffect();
Effect correlatedSamplesEffect();
Effect finiteCoilEffect();
Effect finitePlateEffect();
Effect gainDriftEffect();
Effect globalGainEffect();
Effect gridScaleEffect();
Effect hemisphereFlipEffect();
Effect jigLayerOffsetEffect();
Effect jigTiltEffect();
Effect mainsInterferenceEffect();
Effect metalMovedEffect();
Effect metalPlaneEffect();
Effect quantizationEffect();
Effect rangeNoiseEffect();
Effect sensorOffsetEffect();
Effect transmitterMisalignmentEffect();

}  // namespace fieldtrue::effects
