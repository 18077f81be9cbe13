        if (rows->first) {
            NavState now;
            $place;
            double *place = rows->places + 12 * i;
            place[0] = now.position.x, place[1] = now.position.y, place[2] = now.position.z;
            place[3] = now.velocity.x, place[4] = now.velocity.y, place[5] = now.velocity.z;
            place[6] = now.sigma_position.x, place[7] = now.sigma_position.y, place[8] = now.sigma_position.z;
            place[9] = now.sigma_velocity.x, place[10] = now.sigma_velocity.y, place[11] = now.sigma_velocity.z;
        }
