# Jazzy's generators ask this package for FindPythonExtra, and use nothing of its result but that it was found.
list(APPEND CMAKE_MODULE_PATH "${CMAKE_CURRENT_LIST_DIR}")
