"""An adapter to preCICE: rockfall's solvers as its participants, and its participants as solvers in rockfall."""
