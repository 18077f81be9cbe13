        if (rows->first) {
            for (int64_t k = rows->first[i]; k < rows->first[i + 1]; k++) {
                $aided;
            }
        }
