// The values that cross the border of the core: inputs in, actions out.
#pragma once

#include "core/ports/actions.hpp"
#include "core/ports/inputs.hpp"
